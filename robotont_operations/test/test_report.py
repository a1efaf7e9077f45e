"""What report says at its end."""

import re
import sys

from robotont_operations import report
from robotont_testing.harness import free_port


def test_without_a_black_box_it_says_how_to_have_one_and_a_small_archive_has_a_size(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(report, "COMMANDS", {})
    monkeypatch.setattr(sys, "argv", ["report", "--output", str(tmp_path / "r.tar.gz"), "--black-box", str(tmp_path)])
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "logs"))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{free_port()}")
    assert report.main() == 0
    said = capsys.readouterr().out
    assert "recorder.launch folder:=" in said
    assert re.search(r"r\.tar\.gz: [1-9][0-9]* kB;", said)
