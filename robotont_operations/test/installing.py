"""What tests of install-robot and of booted robots share."""

import contextlib
import io
import shutil
import subprocess
from pathlib import Path
from unittest import mock

import pytest

from robotont_operations import install_robot as install_robot_module
from robotont_operations import installation


def install_robot(root, *words, run=lambda _: True, unreadable=lambda _: None):
    """What install-robot prints, and its exit status, as of a finished process, on a system whose root is a folder."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), mock.patch.multiple(
            install_robot_module, ROOT=Path(root), run=run), mock.patch.object(installation, "unreadable", unreadable):
        try:
            status = install_robot_module.main(list(words))
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def files(root):
    return sorted(str(path.relative_to(root)) for path in Path(root).rglob("*"))


def need(*tools):
    lacking = [tool for tool in tools if not shutil.which(tool)]
    if lacking:
        pytest.skip("these commands are missing: " + ", ".join(lacking))
