"""The rules of the exercises: the robot's true path in, what was wrong out, in words and at which second. Pure code."""

import math
import signal
from typing import Any, NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics import se2

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


class Program(NamedTuple):
    """What the program did."""

    commands: Tuple[float, ...] = ()   # [s] of each command on cmd_vel
    bad_command: float = math.inf      # [s] of the first that is not finite
    nodes: Tuple[str, ...] = ()        # that published on cmd_vel
    status: Any = None                 # exit status; None: it ran until its end was asked for
    error: str = ""                    # last line that it wrote on its end by an error
    ended: float = math.inf            # [s]
    topics: Tuple[str, ...] = ()       # with types, on which it published before any command
    taken: str = ""                    # names of the robot's own nodes that it took


def clearance(run):
    """[m] from the robot's rim to the nearest body, N; below CONTACT it touches."""
    x, y = run.path[:, 1], run.path[:, 2]
    distances = [box_distance(box, x, y) for box in run.world.boxes]
    distances += [np.hypot(x - post.x, y - post.y) - post.length / 2 for post in run.world.posts]
    return np.min(distances, axis=0) - run.radius if distances else np.full(len(x), math.inf)


def box_distance(box, x, y):
    """[m] of places from a box."""
    cos, sin = math.cos(box.yaw), math.sin(box.yaw)
    along = abs(cos * (x - box.x) + sin * (y - box.y)) - box.length / 2
    across = abs(-sin * (x - box.x) + cos * (y - box.y)) - box.width / 2
    return np.hypot(np.maximum(along, 0), np.maximum(across, 0)) + np.minimum(np.maximum(along, across), 0)


def touched_thing(run):
    """Name of what the robot comes nearest to."""
    x, y = run.path[:, 1], run.path[:, 2]
    walls = min((float(np.min(box_distance(box, x, y))) for box in run.world.boxes), default=math.inf)
    posts = min((float(np.min(np.hypot(x - post.x, y - post.y))) - post.length / 2 for post in run.world.posts),
                default=math.inf)
    return "a wall" if walls < posts else "a post or thing"


def touch(run):
    """[s] at which the robot first touches something, or None."""
    touching = clearance(run) < CONTACT
    return float(run.path[np.argmax(touching), 0]) if touching.any() else None


def way(run):
    """[m] that the robot went."""
    return float(np.hypot(*np.diff(run.path[:, 1:3], axis=0).T).sum())


def stands_for(run):
    """[s] for which it stands by now."""
    moving = np.flatnonzero((abs(run.path[:, 4]) > STILL) | (abs(run.path[:, 5]) > STILL_TURN))
    return float(run.path[-1, 0] - run.path[moving[-1] if len(moving) else 0, 0])


def reached(exercise, run):
    """Whether the exercise is done: at its goal, standing for REST, having touched nothing."""
    return stands_for(run) >= REST and not exercise.goal(run) and touch(run) is None


def faults(exercise, run, program):
    """What was wrong, a list of (time [s], words), the earliest first; empty when the exercise is passed."""
    end, touched = float(run.path[-1, 0]), touch(run)
    broken = program.status not in (None, 0)  # which explains the rest
    found = [(program.ended, f"the program ended by an error: {program.error or _status(program.status)}")] \
        if broken else _program_faults(program, run)
    if touched is not None:
        found.append((touched, f"touched {touched_thing(run)}"))
    elif not broken:
        if stands_for(run) < 0.5:
            speed, turn = run.path[-1, 4:]
            found.append((end, f"does not stand at the end: still drives {speed:.2f} m/s and turns {turn:.2f} rad/s"))
        missed = exercise.goal(run)
        if missed:
            late = "the time is over; " if end >= exercise.limit else ""
            found += [(end, late + missed), *_pause(program, end)]
    return sorted(found)


def _status(status):
    """An exit status in words; a shell gives 128 and the number for a signal."""
    number = -status if status < 0 else status - 128
    return signal.Signals(number).name if number in {*signal.Signals} else f"{status}"


def _program_faults(program, run):
    """Those that are seen without the robot, and what explains why it did not move."""
    found = []
    if program.taken:
        found.append((min(program.ended, float(run.path[-1, 0])),
                      f"took the name {program.taken}, which is the robot's: give your node another"))
    if math.isfinite(program.bad_command):
        found.append((program.bad_command, "a command that is not a number (NaN or infinite): the robot refuses it"))
    if len(program.nodes) > 1:
        found.append((min(program.commands), f"{len(program.nodes)} nodes publish on cmd_vel, their commands mix: "
                      + ", ".join(program.nodes)))
    if not program.commands:
        found.append((0.0, f"published no geometry_msgs/Twist on cmd_vel, but on {', '.join(program.topics)}"
                      if program.topics else "published nothing on cmd_vel"))
    elif len(program.commands) == 1:
        found.append((program.commands[0], "published one command only: a command holds for 0.5 s, repeat it"))
    elif len(program.commands) > FLOOD * max(1.0, np.ptp(program.commands)):
        found.append((program.commands[0], f"more than {FLOOD} commands a second on cmd_vel: sleep in your loop"))
    return found


def _pause(program, end):
    """The longest time without a command, if it is worth a word."""
    times = np.array([0.0, *program.commands, min(end, program.ended)])
    longest = int(np.argmax(np.diff(times)))
    pause = np.diff(times)[longest]
    if len(program.commands) < 2 or pause < LONG_PAUSE:
        return []
    if not longest:
        return [(pause, "only now the first command")]
    return [(float(times[longest]), f"no command for {pause:.1f} s: without one the robot stops after 0.5 s")]


def line_distance(segment, x, y):
    """[m] of places from the segment (x1, y1, x2, y2)."""
    x1, y1, x2, y2 = segment
    length = (x2 - x1) ** 2 + (y2 - y1) ** 2
    part = np.clip(((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / length, 0, 1)
    return np.hypot(x - x1 - part * (x2 - x1), y - y1 - part * (y2 - y1))


# The goals: each says what is missing, or nothing.

def square(run):
    """A square of 1 m, to the left or to the right, back to the start."""
    missing = []
    for side in (1.0, -1.0):
        first, nearest = 0, ""
        for number, corner in enumerate(((1, 0), (1, side), (0, side), (0, 0)), 1):
            x, y, _ = se2.compose(run.path[0, 1:4], (*corner, 0.0))
            distance = np.hypot(run.path[first:, 1] - x, run.path[first:, 2] - y)
            if distance.min() > 0.15:
                nearest = f"missed corner {number} of the square by {distance.min():.2f} m, 0.15 m allowed"
                break
            first += int(np.argmax(distance <= 0.15))
        else:
            x, y, _ = se2.between(run.path[0, 1:4], run.pose)
            away = math.hypot(x, y)
            nearest = "" if away <= 0.15 else f"ends {away:.2f} m from its start, 0.15 m allowed"
        missing.append((-number, nearest))
    return "" if any(not words for _, words in missing) else min(missing)[1]


def keep_distance(run):
    """0.6 m from the wall to the robot's middle."""
    distances = box_distance(run.world.boxes[0], run.path[:, 1], run.path[:, 2])
    now = distances[-1]
    if now > distances[0] + 0.1:
        return f"drove away from the wall, to {now:.2f} m (is a sign wrong?)"
    return "" if abs(now - 0.6) <= 0.05 else f"stands {now:.2f} m from the wall, 0.55 to 0.65 m wanted"


def between(run):
    """Through the gap of two posts that stand beside each other, to 0.2 to 1 m behind it."""
    left, right = run.world.posts
    beyond = run.path[:, 1] > left.x
    if not beyond.any():
        return f"never came between the posts: {left.x - run.path[:, 1].max():.2f} m were missing"
    y = run.path[np.argmax(beyond), 2]
    if not right.y < y < left.y:
        return "passed beside the posts"
    behind = run.pose[0] - left.x
    return "" if 0.2 <= behind <= 1.0 else f"stands {behind:.2f} m behind the posts, 0.20 to 1.00 m wanted"


def follow_line(run):
    """Never farther than 0.2 m from the line, to its end."""
    segments = [(*se2.compose((line.x, line.y, line.yaw), (-line.length / 2, 0, 0))[:2],
                 *se2.compose((line.x, line.y, line.yaw), (line.length / 2, 0, 0))[:2])
                for line in run.world.scenery if line.kind == "lines"]
    off = np.min([line_distance(segment, run.path[:, 1], run.path[:, 2]) for segment in segments], axis=0)
    if off.max() > 0.2:
        return f"left the line at {run.path[np.argmax(off > 0.2), 0]:.1f} s"
    missing = math.hypot(run.pose[0] - segments[-1][2], run.pose[1] - segments[-1][3])
    return "" if missing <= 0.5 else f"stands {missing:.2f} m before the line's end, 0.50 m allowed"


def find_red(run):
    """0.4 to 0.7 m before the red thing, looking at it."""
    thing = next(shape for shape in run.world.posts if shape.colour[0] > 2 * max(shape.colour[1:]))
    return _before(run, (thing.x, thing.y), thing.length / 2, (0.4, 0.7), "the red thing")


def _before(run, place, radius, allowed, name):
    """What is missing to stand before something, looking at it."""
    x, y, _ = se2.between(run.pose, (*place, 0.0))
    distance, angle = math.hypot(x, y) - radius, math.degrees(math.atan2(y, x))
    if not allowed[0] <= distance <= allowed[1]:
        return f"stands {distance:.2f} m from {name}, {allowed[0]:.2f} to {allowed[1]:.2f} m wanted"
    return "" if abs(angle) <= 15 else f"looks {abs(angle):.0f} degrees past {name}, 15 allowed"


def _tag(run, number):
    """(x, y, yaw) of a tag: its place on the wall, and where it looks."""
    return next(tag[:3] for tag in run.world.tags if tag[4] == number)


def face_tag(run):
    """0.6 m straight before tag 1."""
    x, y, _ = se2.between(_tag(run, 1), run.pose)
    if abs(y) > 0.1:
        return f"stands {abs(y):.2f} m beside the tag's middle line, 0.10 m allowed"
    return _before(run, _tag(run, 1)[:2], 0.0, (0.53, 0.67), "the tag")


def maze(run):
    """At most 1 m before tag 5, looking at it."""
    return _before(run, _tag(run, 5)[:2], 0.0, (0.3, 1.0), "tag 5")


def reach_goal(run):
    """The place (3.5, 2.5) of the map."""
    missing = math.hypot(run.pose[0] - 3.5, run.pose[1] - 2.5)
    return "" if missing <= 0.25 else f"stands {missing:.2f} m from the goal, 0.25 m allowed"
