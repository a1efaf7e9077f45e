"""Colours on a terminal, and only there."""

import os
import shutil
import sys
import textwrap

RED, GREEN, YELLOW = 31, 32, 33


def paint(text, colour):
    """`text` in a colour where standard output is a terminal and NO_COLOR is not set."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return text
    return f"\033[{colour}m{text}\033[0m"


def hanging(head, words, width):
    """`head`, as wide as `width` on the screen, and words that on a terminal go on below themselves, not below it."""
    if sys.stdout.isatty():
        room = max(20, shutil.get_terminal_size().columns - width)
        words = ("\n" + " " * width).join(textwrap.wrap(words, room, break_on_hyphens=False) or [""])
    return head + words
