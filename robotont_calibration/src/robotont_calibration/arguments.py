"""Types of command line arguments."""

import argparse
import math
import re


def numbers(text, amount, allowed):
    """The numbers, at most 1e6, between the commas or spaces of a text; ArgumentTypeError unless there are so many."""
    try:
        found = [float(field) for field in re.split(r"[,\s]+", text.strip())]
    except ValueError:
        found = []
    if len(found) != amount or not all(abs(value) <= 1e6 for value in found):
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: {allowed}")
    return tuple(found)


def positive(text):
    """A number > 0. Raises ArgumentTypeError."""
    value, = numbers(text, 1, "a number > 0")
    if value <= 0:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: a number > 0")
    return value


def read_end(text):
    """(x [m], y [m], yaw [rad]) of X,Y,YAW in m, m and degrees. Raises ArgumentTypeError."""
    x, y, yaw = numbers(text, 3, "X,Y,YAW of the end, seen from the start [m, m, degrees]")
    return x, y, math.radians(yaw)
