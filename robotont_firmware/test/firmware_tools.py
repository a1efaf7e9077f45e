"""Where the interpreters and files are, for the tests of this package."""

import os
import shutil
import sys
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
ROOT = PACKAGE.parent
SRC = PACKAGE / "src"
DUAL = PACKAGE / "test" / "dual"
GOLDEN = ROOT / "robotont_testing" / "data" / "golden_packets.json"
BOARD_FILES = sorted((SRC / "robotont_firmware").glob("*.py")) + sorted((PACKAGE / "root").glob("*.py"))


def tool(name):
    """Return the path of a program of the project's virtual environment; fail clearly without it."""
    places = [
        str(ROOT / ".build" / "venv" / "bin"),
        os.path.dirname(sys.executable),
        os.environ.get("PATH", ""),
    ]
    found = shutil.which(name, path=os.pathsep.join(places))
    assert found, f"{name} is not installed: run ./robotont setup"
    return found
