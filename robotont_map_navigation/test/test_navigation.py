"""navigation.launch and goto with the real move_base on the simulator; skipped where that is missing."""

from functools import partial

import pytest
from navigation_tools import NAVIGATION_PACKAGES, figures_of, needs

from robotont_map_navigation.goal import Status
from robotont_testing.places import config

pytestmark = needs(*NAVIGATION_PACKAGES)

IN_THE_ROOM, NEARBY = ["--goal", "8", "8", "1.57"], ["--goal", "3", "3", "-3.0"]
ERROR = 0.07  # [m] of the true place at the end; of a hundred goals none was missed by more than 0.05
POSE_ERROR = 0.12   # [m] of the localization, behind a fault
NOT_MOVED = 0.003   # [m] that the truth may wander while the robot stands


run = partial(figures_of, "navigation_run.py")  # a list with those of each goal


def drive(*arguments):
    """Figures of navigation_run.py for each goal, once they are good."""
    figures = run(*arguments, timeout=500)
    for each in figures:
        assert each["status"] == 0, each
        assert each["error_m"] < ERROR, each
        assert each["error_rad"] < 0.1, each
        assert each["clearance_m"] > 0.05, each
    return figures


def test_three_goals_in_a_row():
    figures = drive(*IN_THE_ROOM, "--goal", "1", "8.5", "3.0", "--goal", "9", "1", "-1.57")
    assert len(figures) == 3
    assert sum(each["unseen_m"] for each in figures) < 0.1 * sum(each["way"] for each in figures), figures
    assert max(each["fastest_m_s"] for each in figures) < 1.03 * 0.4, figures


@pytest.mark.parametrize("arguments", [
    [*IN_THE_ROOM, "start:=1.4 0.7 0.3"], [*IN_THE_ROOM, "start:=0.6 1.3 -0.3"], [*NEARBY, "localization:=fake"],
    [*NEARBY, "scan_field_of_view:=6.2831853"], [*NEARBY, "--robot", "four_wheels"]],
    ids=["0.5 m and 0.3 rad off", "to the other side", "the truth", "a laser all around", "four wheels"])
def test_it_gets_there(arguments):
    drive(*arguments)


@pytest.mark.parametrize("start, believed_x, goal", [  # the robot's radius is 0.15 m
    (("5.78", "2.33", "-0.67"), "5.78", ("2.6", "0.28", "0")), (("4.2", "3.7", "-0.4"), "4.2", ("2.6", "0.28", "0")),
    (("9.65", "4.79", "3"), "9.65", ("7.7", "5.53", "0")),
    (("3.80", "3.02", "0.6"), "3.86", ("5.75", "1.78", "0")), (("3.78", "1", "1.57"), "3.9", ("5.75", "1.78", "0")),
    (("4.2", "2.6", "2.5"), "4.14", ("2.6", "0.28", "0"))],
    ids=["around the end of a wall", "around one that is 0.06 m away", "around a box",
         "pressed to its left", "pressed to its left, believed in it", "pressed to its right"])
def test_a_robot_gets_around_a_wall_and_also_where_it_is_pressed_to_it(start, believed_x, goal):
    figures, = run("--start", *start, f"start:={believed_x} {start[1]} {start[2]}", "--goal", *goal, timeout=400)
    assert figures["status"] == 0, figures
    assert figures["seconds"] < 60, figures
    assert figures["error_m"] < ERROR, figures


def test_no_alarm_on_the_right_map_and_one_on_a_map_of_another_place():
    right, = run("--goal", "2.5", "2.5", "0", timeout=400)
    wrong, = run("--world", "maze", "--goal", "2.5", "2.5", "0", f"map:={config('maps/room.yaml')}", timeout=400)
    assert right["alarms"] == []
    assert wrong["status"] == Status.LOST, wrong
    assert "a map of another place" in wrong["words"], wrong


@pytest.mark.parametrize("world", ["room", "maze"])
def test_navigation_comes_back_or_says_what_to_do(world):
    """Nobody waits for ever, goto says how each fault ended, and the robot can be sent again."""
    rows = figures_of("fault_run.py", "--world", world, timeout=1500)
    for row in rows:
        assert row["status"] in row["expected"], row
        assert row["status"] == 0 or row["again"] == 0, row
        assert row["pose_error_m"] < POSE_ERROR, row
        assert row["goal_error_m"] < POSE_ERROR, row
        if row["fault"].startswith("kidnapped"):
            assert "relocalize" in row["words"], row
        if row["fault"].startswith("emergency stop"):
            assert row["stood_s"] < 1.0, row
            assert row["way_after_m"] < NOT_MOVED, row
            assert "cancelled by the emergency stop, pressed by " in row["words"], row
    assert rows
