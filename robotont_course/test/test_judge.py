"""The judge on recorded ways, right and wrong ones."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from robotont_course.exercises import EXERCISES
from robotont_course.judge import Program, Run, faults, reached, touch, way
from robotont_simulator.world import read_world

WORLDS = Path(__file__).resolve().parents[2] / "config" / "worlds"
RADIUS, RATE, SPEED = 0.15, 50, 0.3  # [m], [Hz], [m/s]
GOOD = {  # the corners of a way that is right: x, y [m]; the heading follows it, or is given
    "square": [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)],
    "distance": [(0, 0), (1.35, 0)],
    "between": [(0, 0), (2.2, 0)],
    "line": [(0, 0), (1, 0), (1.5, 0.25), (1.9, 0.65), (2.4, 0.9), (3, 0.9), (3.7, 0.6)],
    "colors": [(0, 0), (-0.2, 0.65)],
    "tag": [(0.6, 0.6), (3.35, 0.6)],
    "maze": [(0.6, 0.6), (3.4, 0.6), (3.4, 1.9), (0.6, 1.9), (0.6, 3.3), (3.3, 3.3)],
    "goal": [(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5), (0.5, 2.5), (2.5, 2.5), (2.5, 0.5), (3.5, 0.5),
             (3.5, 2.5)],
}


def drive(name, corners, rest=3.0, until=math.inf):
    """The `Run` along straight lines, and `rest` [s] at their end."""
    rows = []
    for (x1, y1), (x2, y2) in zip(corners, corners[1:]):
        steps = max(1, round(math.hypot(x2 - x1, y2 - y1) / SPEED * RATE))
        for part in np.arange(steps) / steps:
            rows.append((x1 + part * (x2 - x1), y1 + part * (y2 - y1), math.atan2(y2 - y1, x2 - x1), SPEED, 0.0))
    yaw = rows[-1][2] if rows else 0.0
    rows += [(*corners[-1], yaw, 0.0, 0.0)] * round(rest * RATE)
    path = np.column_stack([np.arange(len(rows)) / RATE, np.array(rows)])
    return Run(path[path[:, 0] <= until], read_world(WORLDS / f"{EXERCISES[name].world}.yaml"), RADIUS)


def program(run, **facts):
    """A `Program` that publishes until the end; times of its commands, nodes in turn, and when one is not finite."""
    times, nodes, bad = facts.pop("commands", np.arange(0.5, run.path[-1, 0], 0.1)), facts.pop("nodes", ("/mine",)), \
        facts.pop("bad_command", math.inf)
    return Program(tuple((time, node, time < bad) for time, node in zip(times, itertools.cycle(nodes))), **facts)


def words(name, corners, rest=3.0, **facts):
    run = drive(name, corners, rest)
    return "; ".join(what for _, what in faults(EXERCISES[name], run, program(run, **facts)))


@pytest.mark.parametrize("name", EXERCISES)
def test_the_right_way_passes_once_the_robot_stands(name):
    run = drive(name, GOOD[name])
    assert faults(EXERCISES[name], run, program(run)) == []
    assert reached(EXERCISES[name], run)
    assert not reached(EXERCISES[name], drive(name, GOOD[name], rest=1.0))
    assert run.path[-1, 0] < EXERCISES[name].limit


def test_a_square_to_the_right_is_one_too():
    assert words("square", [(x, -y) for x, y in GOOD["square"]]) == ""


@pytest.mark.parametrize("name, corners, said", [
    ("square", [(0, 0), (1, 0), (1, 1), (0, 1)], "missed corner 4"),
    ("square", [(0, 0), (0.8, 0), (0.8, 0.8), (0, 0.8), (0, 0)], "missed corner 1 of the square by 0.20 m"),
    ("square", [*GOOD["square"], (0.5, 0)], "stands 0.50 m from its start, 0.00 to 0.15 m wanted"),
    ("distance", [(0, 0), (1.0, 0)], "stands 0.95 m from the wall, 0.55 to 0.65 m wanted"),
    ("distance", [(0, 0), (-1.0, 0)], "drove away from the wall, to 2.95 m (is a sign wrong?)"),
    ("distance", [(0, 0), (1.9, 0)], "touched a wall"),
    ("between", [(0, 0), (1.0, 0)], "never came between the posts: 0.50 m were missing"),
    ("between", [(0, 0), (1.4, 0.9), (2, 0.9)], "passed beside the posts"),
    ("between", [(0, 0), (2.9, 0)], "stands 1.40 m behind the posts"),
    ("between", [(0, 0), (1.6, 0)], "stands 0.10 m behind the posts, 0.20 to 1.00 m wanted"),
    ("between", [(0, 0), (1.4, 0.4)], "touched a post"),
    ("line", [(0, 0), (4, 0)], "left the line at 4."),
    ("line", GOOD["line"][:4], "before the line's end"),
    ("colors", [(0, 0), (0.7, 0.3)], "from the red thing, 0.40 to 0.70 m wanted"),
    ("colors", [(0, 0), (-0.2, 0.65), (-0.3, 0.65)], "past the red thing"),
    ("tag", [(0.6, 0.6), (3.35, 0.6), (3.35, 0.9)], "beside the tag's middle line"),
    ("tag", [(0.6, 0.6), (2.5, 0.6)], "stands 1.45 m from tag 1"),
    ("maze", GOOD["maze"][:4], "from tag 5"),
    ("goal", GOOD["goal"][:5], "stands 3.00 m from the goal"),
])
def test_a_wrong_way_is_named(name, corners, said):
    assert said in words(name, corners)


@pytest.mark.parametrize("facts, said", [
    ({"commands": ()}, "published nothing on cmd_vel"),
    ({"commands": (), "topics": ("/cmd_vel (geometry_msgs/TwistStamped)",)},
     "published no geometry_msgs/Twist on cmd_vel, but on /cmd_vel (geometry_msgs/TwistStamped)"),
    ({"taken": "/robotont_node"}, "took the name /robotont_node, which is the robot's: give your node another"),
    ({"commands": (1.0,)}, "one command only: a command holds for 0.5 s"),
    ({"bad_command": 2.0}, "not a number (NaN or infinite)"),
    ({"nodes": ("/one", "/two")}, "2 nodes publish on cmd_vel, their commands mix: /one, /two"),
    ({"status": 1, "error": "line 3: NameError: x", "ended": 1.0}, "ended by an error: line 3: NameError: x"),
    ({"status": -9}, "ended by an error: SIGKILL"), ({"status": 139}, "ended by an error: SIGSEGV"),
    ({"status": 3}, "ended by an error: 3"), ({"status": 255}, "ended by an error: 255"),
    ({"commands": tuple(np.linspace(0, 3, 9000))}, "more than 500 commands a second"),
    ({"commands": (0.5, 0.6, 0.7)}, "no command for 3.9 s: without one"),
    ({"commands": (3.5, 3.6, 3.7)}, "only now the first command: the time runs from the start of your program"),
])
def test_what_the_program_did_wrong_is_named(facts, said):
    assert said in words("distance", [(0, 0), (0.5, 0)], **facts)


def test_who_never_stops_is_told_so_and_the_second():
    run = drive("distance", [(0, 0), (1.35, 0)], rest=0.0)
    (second, what), = faults(EXERCISES["distance"], run, program(run))
    assert (round(second, 1), what) == (4.5, "does not stand at the end: still drives 0.30 m/s and turns 0.00 rad/s")
    run = drive("distance", [(0, 0), (1.35, 0)], rest=0.3)
    assert [what for _, what in faults(EXERCISES["distance"], run, program(run))] == [
        "stands for less than half a second at the end"]


def test_the_first_touch_counts():
    run = drive("distance", [(0, 0), (1.9, 0), (0, 0)])
    assert touch(run) == (pytest.approx((1.95 - RADIUS) / SPEED, abs=0.05), "a wall")
    assert way(run) == pytest.approx(3.8, abs=0.02)
