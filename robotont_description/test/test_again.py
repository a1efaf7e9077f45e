"""`again` runs a program once more when it crashes, and only then."""

import sys

import pytest

from robotont_description.again import TIMES, main, run


@pytest.mark.parametrize("script, status, runs", [
    ("exit 0", 0, 1), ("exit 3", 3, 1), ("kill -TERM $$", 143, 1), ("kill -SEGV $$", 139, TIMES + 1),
    ("[ $(wc -l <runs) = 2 ] || kill -ABRT $$", 0, 2)])
def test_a_crash_is_not_the_end(script, status, runs, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert run(["sh", "-c", "echo >>runs; " + script]) == status
    assert len((tmp_path / "runs").read_text()) == runs
    assert capfd.readouterr().err.count("started again") == runs - 1


def test_rviz_without_a_display_is_not_even_tried(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(sys, "argv", ["again", "/nowhere/rviz"])
    with pytest.raises(SystemExit, match="rviz needs a display, and DISPLAY is not set"):
        main()
