"""A file is there whole or not at all, with its mode, and nothing else is written through it."""

import os

import pytest

from robotont_driver.parameters.files import new_file, read_file, write_file


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


def test_a_pipe_or_a_device_is_neither_replaced_nor_waited_for(tmp_path):
    """`--output /dev/null` of root would have made it a file."""
    os.mkfifo(str(tmp_path / "pipe"))
    (tmp_path / "link").symlink_to("pipe")
    for name in ("pipe", "link"):
        with pytest.raises(OSError, match="it is no file"):
            write_file(tmp_path / name, "text")
        with pytest.raises(OSError, match="it is no file"):
            read_file(tmp_path / name, 100)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["link", "pipe"]


def test_a_file_is_read_up_to_its_bound(tmp_path):
    (tmp_path / "file").write_bytes(b"12345")
    assert read_file(tmp_path / "file", 5) == b"12345"
    with pytest.raises(OSError, match="it has more than 4 bytes"):
        read_file(tmp_path / "file", 4)
