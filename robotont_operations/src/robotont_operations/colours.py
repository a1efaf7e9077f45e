"""Colours on a terminal, and only there."""

import os
import sys

RED, GREEN, YELLOW, BOLD = 31, 32, 33, 1


def paint(text, colour, stream=sys.stdout):
    """`text` in a colour where `stream` is a terminal and NO_COLOR is not set."""
    if not stream.isatty() or os.environ.get("NO_COLOR"):
        return text
    return f"\033[{colour}m{text}\033[0m"
