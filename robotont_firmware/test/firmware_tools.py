"""Where the interpreters and files are, for the tests of this package."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parent
SRC = PACKAGE / "src"
DUAL = PACKAGE / "test" / "dual"
GOLDEN = ROOT / "robotont_testing" / "data" / "golden_packets.json"


def tool(name):
    """Return the path of a program of the tests' tools; fail clearly without it, skip where it is not to be had."""
    found = shutil.which(name, path=os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", "")]))
    if not found and name == "micropython" and (sys.version_info < (3, 10) or platform.machine() != "x86_64"):
        pytest.skip(f"PyPI has no MicroPython for Python {sys.version_info[0]}.{sys.version_info[1]} "
                    f"on {platform.machine()}")
    assert found, f"{name} is not installed: run ./robotont setup test"
    return found


def run_suite(interpreter, suite, src=SRC):
    """Run a suite of dual/ under "cpython" or "micropython"; return the process, which has ended."""
    program = sys.executable if interpreter == "cpython" else tool(interpreter)
    return subprocess.run([program, str(DUAL / "run.py"), str(src), str(GOLDEN), suite], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=120, check=False)  # fmt: skip
