"""`again` runs a program once more when it crashes, and only then."""

import pytest

from robotont_description.again import TIMES, run


@pytest.mark.parametrize("script, status, runs", [
    ("exit 0", 0, 1), ("exit 3", 3, 1), ("kill -TERM $$", 143, 1), ("kill -SEGV $$", 139, TIMES + 1),
    ("[ $(wc -l <runs) = 2 ] || kill -ABRT $$", 0, 2)])
def test_a_crash_is_not_the_end(script, status, runs, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert run(["sh", "-c", "echo >>runs; " + script]) == status
    assert len((tmp_path / "runs").read_text()) == runs
    assert capfd.readouterr().err.count("started again") == runs - 1
