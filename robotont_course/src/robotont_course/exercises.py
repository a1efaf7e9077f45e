"""The exercises: world, time, what differs from start to start, what the program needs, and the goal.

A goal is a function of a `judge.Run` that says in words what is missing at the end, or nothing.
"""

import math
from typing import Callable, NamedTuple, Tuple

import numpy as np

from robotont_course.judge import Run
from robotont_driver.kinematics import se2

CORNER = 0.15        # [m] within which a square's corner is passed
BESIDE_LINE = 0.175  # [m] from the line's border, at most: 0.2 from its middle
PAST = 15.0          # [degrees] that it looks past a thing, at most


class Exercise(NamedTuple):
    """One exercise."""

    world: str       # of config/worlds
    limit: float     # [s] from the program's start
    spread: Tuple[float, float, float]  # [m, m, rad] by which the start differs, at most
    goal: Callable[[Run], str]
    camera: Tuple[int, ...] = ()  # width and height of the camera's pictures; empty: none
    tags: float = 0.0  # [m] size of the tags that are looked for; 0: none


def square(run):
    """A square of 1 m, to the left or to the right, back to the start."""
    ways, start = [], run.path[0, 1:4]  # how many corners of each were passed, and what is missing
    for side in (1.0, -1.0):
        first, missing = 0, ""
        for number, corner in enumerate(((1, 0), (1, side), (0, side), (0, 0)), 1):
            distance = _distances(run.path[first:], se2.compose(start, (*corner, 0.0)))
            missing = f"missed corner {number} of the square by {distance.min():.2f} m, {CORNER} m allowed"
            if distance.min() > CORNER:
                break
            first += int(np.argmax(distance <= CORNER))
        else:
            number, missing = 5, stands(_distances(run.path, start)[-1], "from its start", 0.0, CORNER)
        ways.append((number, missing))
    return max(ways)[1]


def _distances(path, place):
    """[m] of each place of a path from one."""
    return np.hypot(path[:, 1] - place[0], path[:, 2] - place[1])


def stands(distance, where, least, most):
    """What is missing to stand at a distance [m] within bounds."""
    return "" if least <= distance <= most else f"stands {distance:.2f} m {where}, {least:.2f} to {most:.2f} m wanted"


def keep_distance(run):
    """0.6 m from the wall to the robot's middle."""
    distances = run.world.solids[0].distance(*run.path.T[1:3])
    if distances[-1] > distances[0] + 0.1:
        return f"drove away from the wall, to {distances[-1]:.2f} m (is a sign wrong?)"
    return stands(distances[-1], "from the wall", 0.55, 0.65)


def between(run):
    """Through the gap of two posts that stand beside each other, to 0.2 to 1 m behind it."""
    left, right = (shape for shape in run.world.shapes if shape.kind == "posts")
    beyond = run.path[:, 1] > left.x
    if not beyond.any():
        return f"never came between the posts: {left.x - run.path[:, 1].max():.2f} m were missing"
    if not right.y < run.path[np.argmax(beyond), 2] < left.y:
        return "passed beside the posts"
    return stands(run.pose[0] - left.x, "behind the posts", 0.2, 1.0)


def follow_line(run):
    """Never farther than 0.2 m from the line, to its end."""
    lines = [shape for shape in run.world.shapes if shape.kind == "lines"]
    off = np.min([line.distance(*run.path.T[1:3]) for line in lines], axis=0)
    if off.max() > BESIDE_LINE:
        return f"left the line at {run.path[np.argmax(off > BESIDE_LINE), 0]:.1f} s"
    last = lines[-1]
    end = se2.compose((last.x, last.y, last.yaw), (last.length / 2, 0.0, 0.0))
    return stands(_distances(run.path, end)[-1], "before the line's end", 0.0, 0.5)


def find_red(run):
    """0.4 to 0.7 m before the red thing, looking at it."""
    thing = next(shape for shape in run.world.solids if shape.colour[0] > 2 * max(shape.colour[1:]))
    return stands(thing.distance(*run.pose[:2]), "from the red thing", 0.4, 0.7) or looks_at(
        run, (thing.x, thing.y), "the red thing")


def looks_at(run, place, name):
    """What is missing to look at a place."""
    x, y, _ = se2.between(run.pose, (*place[:2], 0.0))
    angle = abs(math.degrees(math.atan2(y, x)))
    return "" if angle <= PAST else f"looks {angle:.0f} degrees past {name}, {PAST:g} allowed"


def before_tag(number, least, most, aside=math.inf):
    """The goal to stand some distance [m] before a tag, looking at it, at most `aside` [m] of its middle line."""
    def goal(run):
        tag = next(tag[:3] for tag in run.world.tags if tag[4] == number)
        beside = abs(se2.between(tag, run.pose)[1])
        if beside > aside:
            return f"stands {beside:.2f} m beside the tag's middle line, {aside:.2f} m allowed"
        return stands(_distances(run.path, tag)[-1], f"from tag {number}", least, most) or looks_at(
            run, tag, f"tag {number}")
    return goal


def reach_goal(run):
    """The place (3.5, 2.5) of the map."""
    return stands(_distances(run.path, (3.5, 2.5))[-1], "from the goal", 0.0, 0.25)


EXERCISES = {
    "square": Exercise("empty", 40.0, (1.0, 1.0, 3.1), square),
    "distance": Exercise("bangbang", 25.0, (0.5, 0.4, 0.05), keep_distance),
    "between": Exercise("between", 25.0, (0.3, 0.25, 0.2), between),
    "line": Exercise("line", 50.0, (0.1, 0.05, 0.15), follow_line, (424, 240)),
    "colors": Exercise("colors", 40.0, (0.2, 0.2, 3.1), find_red, (424, 240)),
    "tag": Exercise("tags", 30.0, (0.35, 0.1, 0.25), before_tag(1, 0.53, 0.67, 0.1), (640, 360), 0.25),
    "maze": Exercise("tags", 120.0, (0.2, 0.1, 0.25), before_tag(5, 0.3, 1.0), (640, 360), 0.25),
    "goal": Exercise("minimaze", 100.0, (0.1, 0.1, 3.1), reach_goal),
}
