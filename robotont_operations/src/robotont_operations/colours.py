"""Colours on a terminal, and only there."""

import os
import sys

RED, GREEN, YELLOW = 31, 32, 33


def paint(text, colour):
    """`text` in a colour where standard output is a terminal and NO_COLOR is not set."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return text
    return f"\033[{colour}m{text}\033[0m"
