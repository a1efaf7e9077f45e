"""The demo's parts without ROS: its plan, when it begins, its command line, its picture."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from robotont_calibration.trajectory import Trajectory
from robotont_demo.demo import parse
from robotont_demo.recording import obeys
from robotont_demo.scenario import PERIOD, draw, plan
from robotont_driver.kinematics import se2


def test_the_plan_is_a_square_and_a_circle_with_one_turn_within_the_limits():
    twists = np.array(plan(0.4))
    path = se2.path(PERIOD * twists)
    stands = path[~twists.any(axis=1)].round(6)
    corners = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0), (0, 0, round(2 * math.pi, 6))]
    assert list(dict.fromkeys(map(tuple, stands))) == corners
    assert np.hypot(*twists.T[:2]).max() == pytest.approx(0.4, rel=0.03)
    np.testing.assert_allclose(np.hypot(*(path[twists[:, 2] != 0, :2] - (-0.5, 0.0)).T), 0.5)


def test_the_drive_begins_when_commands_reach_a_board_that_obeys():
    asked = DiagnosticStatus(level=DiagnosticStatus.WARN)  # who it is
    known = DiagnosticStatus(level=DiagnosticStatus.OK)
    assert not obeys(known, None)
    assert not obeys(known, {"packets written": "0"})
    assert not obeys(asked, {"packets written": "3"})
    assert obeys(known, {"packets written": "3"})


def test_a_picture_that_cannot_be_written_is_refused_before_the_drive(capsys):
    with pytest.raises(SystemExit) as end:
        parse(["--picture", "/no/such/folder/demo.png"])
    assert end.value.code == 2
    assert "No such file or directory: '/no/such/folder/demo.png'" in capsys.readouterr().err


def test_the_picture(tmp_path):
    odometry, truth = (Trajectory([0.0, 1.0], [(0, 0, 0), (end, 0, 1.0)]) for end in (1.01, 1.0))
    draw(tmp_path / "demo.png", "demo", odometry, truth, 0.03)
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")
