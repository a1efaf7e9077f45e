"""Reads a QR code from lines of a terminal, as a phone's camera does from its screen."""

import numpy as np
from PIL import Image

from robotont_teleop.web.page_setup import LIGHT_ON_BLACK, RESET
from robotont_testing.harness import tool_module

HALVES = {"█": (255, 255), "▀": (255, 0), "▄": (0, 255), " ": (0, 0)}  # brightness of upper and lower half
PIXELS = 6  # of a module


def read_qr(lines):
    """Text of the QR code among the lines of a dark terminal."""
    zxingcpp = tool_module("zxingcpp")
    rows = [line.replace(LIGHT_ON_BLACK, "").replace(RESET, "") for line in lines]
    rows = [row for row in rows if row and set(row) <= set(HALVES)]
    modules = np.array([[HALVES[sign][half] for sign in row] for row in rows for half in (0, 1)], dtype=np.uint8)
    picture = Image.fromarray(np.kron(np.pad(modules, 4), np.ones((PIXELS, PIXELS), dtype=np.uint8)), "L")
    found = zxingcpp.read_barcodes(picture)
    assert len(found) == 1, f"{len(found)} codes in {len(rows)} lines"
    return found[0].text
