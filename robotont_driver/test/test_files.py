"""A file is there whole or not at all, with its mode, and nothing else is written through it."""

import os

import pytest

from robotont_driver.parameters.files import new_file, write_file


def test_a_file_and_its_mode_take_the_place_of_an_older_one(tmp_path):
    path = tmp_path / "odd \udcff name"
    path.write_text("old and longer")
    path.chmod(0o666)
    other = tmp_path / "hard link"
    os.link(str(path), str(other))
    write_file(path, "new ä", 0o600)
    assert (path.read_text("utf-8"), path.stat().st_mode & 0o777) == ("new ä", 0o600)
    assert other.read_text() == "old and longer"


def test_what_fails_half_way_leaves_the_old_file_and_nothing_beside(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")

    def fail_half_way():
        with new_file(path) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [("file", "old")]


def test_a_link_is_not_followed(tmp_path):
    path = tmp_path / "place"
    os.symlink("target", path)
    write_file(path, "text")
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [("place", "text")]
