"""What tests of install-robot and of booted robots share."""

import contextlib
import io
import shutil
import subprocess
from pathlib import Path

import pytest

from robotont_operations import install_robot as install_robot_module


def install_robot(root, *words):
    """What install-robot prints, and its exit status, as of a finished process; a root that is there is an image."""
    if Path(root).is_dir():
        (Path(root) / "etc").mkdir(exist_ok=True)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = install_robot_module.main(["--root", str(root), *words])
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def files(root):
    return sorted(str(path.relative_to(root)) for path in Path(root).rglob("*"))


def need(*tools):
    lacking = [tool for tool in tools if not shutil.which(tool)]
    if lacking:
        pytest.skip("these commands are missing: " + ", ".join(lacking))
