"""What tests of install-robot and of booted robots share."""

import contextlib
import io
import shutil
import subprocess
import unittest.mock
from pathlib import Path

import pytest

from robotont_operations import install_robot as install_robot_module


@contextlib.contextmanager
def arguments(*words):
    """A block in which this process was started with these."""
    with unittest.mock.patch("sys.argv", ["install-robot", *map(str, words)]):
        yield


def install_robot(*words):
    """What install-robot prints, and its exit status, as of a finished process; a --root is an image."""
    for root in [Path(after) for word, after in zip(words, words[1:]) if word == "--root" and Path(after).is_dir()]:
        (root / "etc").mkdir(exist_ok=True)
    out, err = io.StringIO(), io.StringIO()
    with arguments(*words), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = install_robot_module.main()
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def files(root):
    return sorted(str(path.relative_to(root)) for path in Path(root).rglob("*"))


def need(*tools):
    lacking = [tool for tool in tools if not shutil.which(tool)]
    if lacking:
        pytest.skip("these commands are missing: " + ", ".join(lacking))
