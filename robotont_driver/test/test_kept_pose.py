"""Where odom_node goes on after it has ended, and where it must not."""

import os
import sys

import pytest
import rospy

from robotont_driver.odometry.odometry import NONE, Covariance
from robotont_driver.ros import kept_pose
from robotont_driver.ros.kept_pose import LONGEST_GAP, KeptPose

POSE, MOVED, TWIST = (1.0, -2.0, 3.0), (1.5, -2.0, 3.0), (0.3, 0.4, 2.0)
P = Covariance(1.0, 0.1, 0.2, 2.0, 0.3, 3.0)


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    monkeypatch.setattr(kept_pose, "FOLDER", tmp_path)
    monkeypatch.setattr(sys, "argv", ["odom_node", "__name:=odom_node", "__log:=/tmp/log"])  # as roslaunch does
    return tmp_path


def start(now):
    return KeptPose("/robot/odom_node", now)


@pytest.mark.parametrize("now, gap", [(14.0, 2.0), (12.1 + LONGEST_GAP, None), (3.0, None)],
                         ids=["soon", "too long ago", "a reboot"])
def test_the_next_run_goes_on_from_the_newest_pose(now, gap):
    first = start(10.0)
    assert first.gap is None
    first.keep(POSE, P, TWIST, 11.0)
    first.keep(MOVED, P, TWIST, 12.0)
    found = start(now)
    assert found.gap == gap
    if gap:
        assert found.pose == MOVED
        assert found.covariance == pytest.approx(P.plus(Covariance(1.0, 0.0, 0.0, 1.0, 0.0, 16.0))), "2 s as before"


@pytest.mark.parametrize("what", ["started by hand", "another launch"])
def test_who_starts_it_anew_begins_at_the_origin(what, monkeypatch):
    start(10.0).keep(POSE, P, TWIST, 12.0)
    if what == "another launch":
        monkeypatch.setattr(os, "getppid", lambda: 1)
    else:
        monkeypatch.setattr(sys, "argv", ["odom_node"])
    assert start(13.0).gap is None


def test_a_full_disk_is_one_warning(monkeypatch):
    warned = []
    monkeypatch.setattr(rospy, "logwarn", lambda *_: warned.append(1))
    kept = start(10.0)

    def full(*_):
        raise OSError(28, "No space left on device")
    monkeypatch.setattr(os, "pwrite", full)
    for _ in range(50):
        kept.keep(POSE, P, TWIST, 12.0)
    assert len(warned) == 1


def test_a_link_of_another_user_is_not_followed(folder, monkeypatch):
    monkeypatch.setattr(rospy, "logwarn", lambda *_: None)
    start(10.0).keep(POSE, NONE, TWIST, 11.0)
    file, = folder.iterdir()
    file.unlink()
    target = folder / "target"
    target.write_bytes(b"mine")
    os.symlink(str(target), str(file))
    run = start(12.0)
    run.keep(POSE, NONE, TWIST, 13.0)
    assert run.gap is None
    assert target.read_bytes() == b"mine"
