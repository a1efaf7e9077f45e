"""Types of command line arguments."""

import argparse
import math
import re


def positive(text):
    """A number > 0. Raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: a number > 0")
    return value


def coordinates(text):
    """(x, y) of "X,Y". Raises ArgumentTypeError."""
    try:
        x, y = map(float, text.split(","))
    except ValueError:
        x = y = math.nan
    if not math.isfinite(x + y):
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: X,Y [m]")
    return x, y


def point(text):
    """"free", or (x, y) [m] of "fixed" (the robot's middle) or "X,Y". Raises ArgumentTypeError."""
    if text in ("free", "fixed"):
        return "free" if text == "free" else (0.0, 0.0)
    try:
        return coordinates(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: free, fixed or X,Y [m]") from None


def read_end(text):
    """(x [m], y [m], yaw [rad]) of X,Y,YAW in m, m and degrees. Raises ValueError."""
    fields = re.split(r"[,\s]+", text.strip())
    try:
        numbers = [float(field) for field in fields]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"found {text!r}, allowed: X,Y,YAW of the end, seen from the start [m, m, degrees]")
    return numbers[0], numbers[1], math.radians(numbers[2])
