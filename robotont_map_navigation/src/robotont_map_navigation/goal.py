"""A place to go to and how far it is, in plain numbers and strings, without ROS."""

import math
from typing import NamedTuple

FARTHEST = 1000.0        # [m] from the map's origin; more is a mistake
FULL_TURN = 2 * math.pi  # [rad] more is a mistake: degrees
# exit statuses
DONE, GAVE_UP, WRONG_INPUT, NOT_THERE, REPLACED, TOO_LONG, REFUSED, NEAR, LOST, INTERRUPTED = *range(9), 130
NEAR_DISTANCE, NEAR_TURN = 0.1, 0.2  # [m], [rad] farther away a goal was not reached, whatever move_base says


class Goal(NamedTuple):
    """A pose on the map."""

    x: float    # [m]
    y: float    # [m]
    yaw: float  # [rad]

    def __str__(self):
        return f"({self.x:.2f}, {self.y:.2f}, {self.yaw:.2f})"


class Outcome(NamedTuple):
    """How a goal ended."""

    status: int  # exit status
    words: str


def read_coordinate(text):
    """[m] from a string; raises ValueError with the found and the allowed values."""
    return _number(text, FARTHEST, f"a number from -{FARTHEST:g} to {FARTHEST:g} [m]")


def read_yaw(text):
    """[rad] from a string; raises ValueError with the found and the allowed values."""
    return _number(text, FULL_TURN + 1e-3, "a number from -6.28 to 6.28 [rad], not degrees")


def read_seconds(text):
    """[s] >= 0 from a string; raises ValueError with the found and the allowed values."""
    seconds = _number(text, 1e6, "a number from 0 to 1000000 [s]")
    if seconds < 0:
        raise ValueError(f"found {text.strip()!r}, allowed: a number from 0 to 1000000 [s]")
    return seconds


def _number(text, largest, allowed):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= largest:
        raise ValueError(f"found {text.strip()!r}, allowed: {allowed}")
    return value


def protect_negative(words):
    """Words of a command line; a space before negative numbers, so that argparse takes none (-1e-3) for an option."""
    return [" " + word if _is_negative(word) else word for word in words]


def _is_negative(word):
    try:
        float(word)
    except ValueError:
        return False
    return word.startswith("-")


def remaining(pose, goal):
    """(distance [m], turn [rad], 0 to pi) between two poses (x, y, yaw)."""
    return (math.hypot(goal[0] - pose[0], goal[1] - pose[1]),
            abs(math.remainder(goal[2] - pose[2], 2 * math.pi)))


def progress(pose, goal, elapsed):
    """Progress message for a robot at `pose` (None: unknown), `elapsed` [s] after it was sent to `goal`."""
    if pose is None:
        return f"{elapsed:4.0f} s  waiting for move_base to report the robot's pose"
    distance, turn = remaining(pose, goal)
    return f"{elapsed:4.0f} s  at {Goal(*pose)}, {distance:.2f} m and {turn:.2f} rad to go"


def outcome(state, text, goal, pose, elapsed):
    """Outcome of a goal that move_base ended after `elapsed` [s] with an actionlib `state` (its name) and a `text`."""
    left = ""
    if pose is not None:
        left = "{:.2f} m and {:.2f} rad".format(*remaining(pose, goal))
    if state == "SUCCEEDED" and pose is not None:
        distance, turn = remaining(pose, goal)
        if distance > NEAR_DISTANCE or turn > NEAR_TURN:
            return Outcome(NEAR, f"as near as possible to {goal} after {elapsed:.1f} s: {left} away")
    if state == "SUCCEEDED":
        return Outcome(DONE, f"reached {goal} after {elapsed:.1f} s" + (f", within {left}" if left else ""))
    if state in ("PREEMPTED", "RECALLED"):
        return Outcome(REPLACED, f"cancelled by another client, or another goal took its place, after {elapsed:.1f} s")
    if state == "LOST":
        return Outcome(NOT_THERE, f"move_base died after {elapsed:.1f} s and was started again: send the goal again")
    reason = text.strip().rstrip(".") or "no reason given"
    return Outcome(GAVE_UP, f"move_base gave up ({state}): {reason}" + (f"; {left} were left" if left else ""))
