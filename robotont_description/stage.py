"""RViz on a screen that is not there, and a robot that is not there to look at. For tests and pictures."""

import struct
import sys
from pathlib import Path

import numpy as np
import yaml

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "robotont_driver" / "test"))

from board import Board  # noqa: E402
from harness import wait_for  # noqa: E402

WIDTH, HEIGHT = 1280, 800


class Screen:
    """An X server without a monitor; `environment` leads programs to it. Ends with `processes`."""

    def __init__(self, processes):
        folder = processes.folder
        number = folder / "display"
        # the server takes a free display and says which; its picture lies in a file
        processes.start("Xvfb", "-displayfd", "1", "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "+extension", "GLX",
                        "-nolisten", "tcp", "-nocursor", "-fbdir", folder, log=number)
        wait_for(lambda: _display_of(number), "the X server")
        self._frame = folder / "Xvfb_screen0"
        self.environment = {"DISPLAY": f":{_display_of(number)}", "LIBGL_ALWAYS_SOFTWARE": "1",
                            "HOME": str(folder), "XDG_RUNTIME_DIR": str(folder), "QT_X11_NO_MITSHM": "1"}

    def picture(self):
        """What the screen shows: HEIGHT x WIDTH x 3, 0 to 255, red, green, blue."""
        data = self._frame.read_bytes()
        header = struct.unpack(">25I", data[:100])  # of an X window dump
        start = header[0] + 12 * header[19]         # its size, and the colour map
        pixels = np.frombuffer(data, np.uint8, HEIGHT * header[12], start).reshape(HEIGHT, header[12] // 4, 4)
        return pixels[:, :WIDTH, 2::-1].astype(int)


def _display_of(file):
    digits = [line for line in file.read_text().splitlines() if line.isdigit()] if file.exists() else []
    return digits[0] if digits else None
