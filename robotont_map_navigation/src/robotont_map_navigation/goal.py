"""A place to go to, how far it is, and how a goal ended, without ROS."""

import math
from enum import IntEnum
from typing import NamedTuple

NEAR_DISTANCE, NEAR_TURN = 0.1, 0.2  # [m], [rad] farther away a goal was not reached, whatever move_base says


class Goal(NamedTuple):
    """A pose on the map."""

    x: float    # [m]
    y: float    # [m]
    yaw: float  # [rad]

    def __str__(self):
        return f"({self.x:.2f}, {self.y:.2f}, {self.yaw:.2f})"


class Status(IntEnum):
    """Exit statuses of goto and relocalize; 2 is that of wrong arguments."""

    DONE, GAVE_UP, NOT_THERE, REPLACED, REFUSED, NEAR, LOST, INTERRUPTED = 0, 1, 3, 4, 6, 7, 8, 130


class Outcome(NamedTuple):
    """How a goal ended."""

    status: Status
    words: str


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
    distance, turn = remaining(pose, goal) if pose else (0.0, 0.0)
    left, after = f"{distance:.2f} m and {turn:.2f} rad", f"after {elapsed:.1f} s"
    if state == "SUCCEEDED":
        if distance > NEAR_DISTANCE or turn > NEAR_TURN:
            return Outcome(Status.NEAR, f"as near as possible to {goal} {after}: {left} away")
        return Outcome(Status.DONE, f"reached {goal} {after}" + (f", within {left}" if pose else ""))
    if state in ("PREEMPTED", "RECALLED"):
        return Outcome(Status.REPLACED, f"cancelled by another client, or another goal took its place, {after}")
    if state == "LOST":
        return Outcome(Status.NOT_THERE, f"move_base died {after} and was started again: send the goal again")
    reason = text.strip().rstrip(".") or "no reason given"
    return Outcome(Status.GAVE_UP, f"move_base gave up ({state}): {reason}" + (f"; {left} were left" if pose else ""))
