"""Where odom_node goes on after it has ended, and where it must not."""

import os

import pytest
import rospy

from robotont_driver.odometry.covariance import NONE, Covariance
from robotont_driver.ros import kept_pose
from robotont_driver.ros.kept_pose import LONGEST_GAP, KeptPose

POSE, MOVED, TWIST = (1.0, -2.0, 3.0), (1.5, -2.0, 3.0), (0.3, 0.4, 2.0)
P = Covariance(1.0, 0.1, 0.2, 2.0, 0.3, 3.0)


@pytest.fixture
def parameters(monkeypatch, tmp_path):
    """Those of a master, in a dict; the file is in `tmp_path`."""
    found = {}
    monkeypatch.setattr(kept_pose, "FOLDER", tmp_path)
    monkeypatch.setattr(rospy, "get_param", lambda name, default: found.get(name, default))
    monkeypatch.setattr(rospy, "set_param", found.__setitem__)
    monkeypatch.setattr(kept_pose.fcntl, "flock", lambda *_: None)  # all runs are in this process
    return found


def start(now):
    return KeptPose("/robot/odom_node", now)


@pytest.mark.parametrize("now, new_launch, gap", [
    (14.0, False, 2.0), (13.0, True, None), (12.1 + LONGEST_GAP, False, None), (3.0, False, None)],
    ids=["soon", "a new launch", "too long ago", "a reboot"])
def test_the_next_run_goes_on_from_the_newest_pose_with_the_gap_in_its_covariance(parameters, now, new_launch, gap):
    first = start(10.0)
    assert first.found is None
    first.keep(POSE, P, TWIST, 11.0)
    first.keep(MOVED, P, TWIST, 12.0)
    if new_launch:
        parameters.clear()  # as `clear_params` of robot.launch does
    found = start(now).found
    assert (found and (found.pose, found.gap)) == (gap and (MOVED, gap))
    if found:
        assert found.covariance == pytest.approx(P.plus(Covariance(0.25, 0.0, 0.0, 0.25, 0.0, 4.0)))


def test_a_link_of_another_user_is_not_followed(parameters, tmp_path):
    start(10.0).keep(POSE, NONE, TWIST, 11.0)
    file, = tmp_path.iterdir()
    file.unlink()
    target = tmp_path / "target"
    target.write_bytes(b"mine")
    os.symlink(str(target), str(file))
    run = start(12.0)
    run.keep(POSE, NONE, TWIST, 13.0)
    assert run.found is None
    assert target.read_bytes() == b"mine"


def test_a_new_run_clears_away_what_nobody_goes_on_with(parameters, tmp_path):
    start(10.0).keep(POSE, NONE, TWIST, 11.0)
    old, = tmp_path.iterdir()
    parameters.clear()
    start(12.0).keep(POSE, NONE, TWIST, 12.0)
    assert old in tmp_path.iterdir(), "somebody may still go on with it"
    parameters.clear()
    start(12.0 + LONGEST_GAP)
    assert old not in tmp_path.iterdir()
