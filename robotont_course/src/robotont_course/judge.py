"""The rules of all exercises: the robot's true path in, what was wrong out, in words and at which second. Pure code."""

import math
import signal
from typing import Any, NamedTuple, Tuple

import numpy as np

STILL, STILL_TURN = 0.02, 0.05  # [m/s], [rad/s] below which the robot stands
REST = 2.0      # [s] of standing at the goal that end an exercise
CONTACT = 0.003  # [m] of clearance at which bodies touch, as the physics lets them
LONG_PAUSE = 3.0  # [s] without a command that is worth a word
FLOOD = 500     # commands per second that are worth a word


class Run(NamedTuple):
    """What the robot did: `path`, N x 6 of the time [s], the true x, y [m], yaw [rad], speed [m/s], turn [rad/s]."""

    path: np.ndarray
    world: Any     # `World`
    radius: float  # [m] of the robot

    @property
    def pose(self):
        """The last one: x [m], y [m], yaw [rad]."""
        return tuple(self.path[-1, 1:4])

    @property
    def end(self):
        """[s] of the last pose."""
        return float(self.path[-1, 0])


class Program(NamedTuple):
    """What the program did."""

    commands: Tuple[Tuple[float, str, bool], ...] = ()  # on cmd_vel: [s], by which node, whether finite
    status: Any = None                 # exit status; None: it ran until its end was asked for
    error: str = ""                    # last line that it wrote on its end by an error
    ended: float = math.inf            # [s]
    topics: Tuple[str, ...] = ()       # with types, on which it published before any command
    taken: str = ""                    # names of the robot's own nodes that it took


def touch(run):
    """([s], what) of the first touch; None without one."""
    solids = run.world.solids
    near = np.array([shape.distance(*run.path.T[1:3]) < run.radius + CONTACT for shape in solids])
    if not near.any():
        return None
    row = int(np.argmax(near.any(axis=0)))
    wall = solids[int(np.argmax(near[:, row]))].kind in ("walls", "boxes")
    return float(run.path[row, 0]), "a wall" if wall else "a post or thing"


def way(run):
    """[m] that the robot went."""
    return float(np.hypot(*np.diff(run.path[:, 1:3], axis=0).T).sum())


def stands_for(run):
    """[s] for which it stands by now."""
    moving = np.flatnonzero((abs(run.path[:, 4]) > STILL) | (abs(run.path[:, 5]) > STILL_TURN))
    return run.end - float(run.path[moving[-1] if len(moving) else 0, 0])


def reached(exercise, run):
    """Whether the exercise is done: at its goal, standing for REST, having touched nothing."""
    return stands_for(run) >= REST and not exercise.goal(run) and touch(run) is None


def faults(exercise, run, program):
    """What was wrong, a list of (time [s], words), the earliest first; empty when the exercise is passed."""
    broken, touched = program.status not in (None, 0), touch(run)  # broken: which explains the rest
    found = [(program.ended, f"the program ended by an error: {program.error or _status(program.status)}")] \
        if broken else list(_program_faults(program, run.end))
    if touched:
        found.append((touched[0], f"touched {touched[1]}"))
    elif not broken:
        if stands_for(run) < 0.5:
            speed, turn = run.path[-1, 4:]
            still = abs(speed) <= STILL and abs(turn) <= STILL_TURN
            found.append((run.end, "stands for less than half a second at the end" if still else
                          f"does not stand at the end: still drives {speed:.2f} m/s and turns {turn:.2f} rad/s"))
        missed = exercise.goal(run)
        if missed:
            late = "the time is over; " if run.end >= exercise.limit else ""
            found += [(run.end, late + missed), *_pause(program, run.end)]
    return sorted(found)


def _status(status):
    """An exit status in words; a shell gives 128 and the number for a signal."""
    number = -status if status < 0 else status - 128
    return signal.Signals(number).name if number in {*signal.Signals} else f"{status}"


def _program_faults(program, end):
    """Those that are seen without the robot, and what explains why it did not move."""
    commands, nodes = [second for second, _, _ in program.commands], sorted({node for _, node, _ in program.commands})
    bad = [second for second, _, finite in program.commands if not finite]
    if program.taken:
        yield min(program.ended, end), f"took the name {program.taken}, which is the robot's: give your node another"
    if bad:
        yield bad[0], "a command that is not a number (NaN or infinite), as -inf of a sensor times a factor: " \
            "the robot refuses it"
    if len(nodes) > 1:
        yield commands[0], f"{len(nodes)} nodes publish on cmd_vel, their commands mix: {', '.join(nodes)}"
    if not commands:
        yield 0.0, f"published no geometry_msgs/Twist on cmd_vel, but on {', '.join(program.topics)}" \
            if program.topics else "published nothing on cmd_vel"
    elif len(commands) == 1:
        yield commands[0], "published one command only: a command holds for 0.5 s, repeat it"
    elif len(commands) > FLOOD * max(1.0, np.ptp(commands)):
        yield commands[0], f"more than {FLOOD} commands a second on cmd_vel: sleep in your loop"


def _pause(program, end):
    """The longest time without a command, if it is worth a word."""
    times = np.array([0.0, *(second for second, _, _ in program.commands), min(end, program.ended)])
    longest = int(np.argmax(np.diff(times)))
    pause = np.diff(times)[longest]
    if len(program.commands) < 2 or pause < LONG_PAUSE:
        return []
    if not longest:
        return [(pause, "only now the first command: the time runs from the start of your program")]
    return [(float(times[longest]), f"no command for {pause:.1f} s: without one the robot stops after 0.5 s")]
