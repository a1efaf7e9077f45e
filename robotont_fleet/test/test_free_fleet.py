"""free_fleet's own adapter for ROS 1 robots, unchanged, reads a robot of ours and sends it two goals and a cancel.

It is fetched beside, never a part of this repository: ROBOTONT_FREE_FLEET or .build/free_fleet, as git clone
https://github.com/open-rmf/free_fleet makes it. rclpy and RMF are stood in for.
"""

import importlib
import math
import os
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import pytest
import rospy
from fleet_rig import Rig, wait_until_driving
from tf2_ros import BufferCore

from robotont_fleet import zenoh_keys as keys
from robotont_fleet.zenoh_setup import client_settings, open_session, zenoh
from robotont_testing.harness import tool_module, wait_for

ROOT = Path(__file__).resolve().parents[2]
FREE_FLEET = Path(os.environ.get("ROBOTONT_FREE_FLEET", str(ROOT / ".build" / "free_fleet")))
pytestmark = [
    pytest.mark.timed, pytest.mark.skipif(zenoh is None, reason="no zenoh on this system"),
    pytest.mark.skipif(not (FREE_FLEET / "free_fleet_adapter").is_dir(), reason="no free_fleet at ROBOTONT_FREE_FLEET"),
    pytest.mark.skipif(sys.version_info < (3, 10), reason="free_fleet needs Python 3.10")]


STOOD_IN = ("rclpy", "rclpy.time", "rclpy.node", "rmf_adapter", "rmf_adapter.easy_full_control", "builtin_interfaces",
            "rmf_adapter.robot_update_handle", "builtin_interfaces.msg", "tf_transformations",
            "free_fleet.ros2_types")  # the last: DDS, which no ROS 1 robot speaks


class Buffer(BufferCore):
    def lookup_transform(self, target, source, _when):
        return self.lookup_transform_core(target, source, rospy.Time())


@pytest.fixture(scope="module")
def adapter_module():
    tool_module("rosbags.typesys")
    modules = {name: mock.MagicMock() for name in STOOD_IN}
    time_module, transformations = modules["rclpy.time"], modules["tf_transformations"]
    modules["rclpy"].time = time_module
    time_module.Time = lambda seconds=0, nanoseconds=0: SimpleNamespace(
        to_msg=lambda: rospy.Time(seconds, nanoseconds))
    transformations.euler_from_quaternion = lambda q: (0.0, 0.0, 2 * math.atan2(q[2], q[3]))
    transformations.quaternion_from_euler = lambda _r, _p, yaw: (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    paths = [str(FREE_FLEET / "free_fleet"), str(FREE_FLEET / "free_fleet_adapter"), *sys.path]
    with mock.patch.dict(sys.modules, modules), mock.patch.object(sys, "path", paths):
        yield importlib.import_module("free_fleet_adapter.nav1_robot_adapter")


@pytest.fixture(scope="module")
def rig():
    with Rig() as one:
        one.start_page()
        one.add_robot("r1")
        wait_until_driving(one, one.robots["r1"])
        yield one


@pytest.fixture
def session(rig):
    with open_session(client_settings(f"tcp/127.0.0.1:{rig.router_port}")) as one:
        yield one


def test_the_keys_are_those_of_its_own_function(adapter_module):
    for topic in (*keys.OUT, *keys.IN):
        package, name = topic[1]._type.split("/")
        assert keys.ros_key(topic, "r1") == adapter_module.get_zenoh_name_of_ros1_topic(
            adapter_module.ROS1_STORE, f"/r1/{topic[0]}", f"{package}/msg/{name}")


def test_it_reads_the_robot_sends_it_two_goals_and_cancels_the_second(adapter_module, rig, session):
    node = mock.MagicMock()
    node.get_clock().now().seconds_nanoseconds = lambda: divmod(time.time_ns(), 10 ** 9)
    settings = {"initial_map": "L1", "robot_frame": "base_link"}
    robot = adapter_module.Nav1RobotAdapter("r1", None, settings, node, session, None, Buffer())
    wait_for(robot.get_pose, "a pose")
    seen = rig.seen("r1")["pose"]
    wait_for(lambda: robot.get_pose()[0] >= seen[0], "a pose that moves on")
    assert robot.get_pose()[1:] == pytest.approx(seen[1:], abs=0.02)
    wait_for(lambda: robot.get_battery_soc() == 0.75, "the battery")
    handler = robot.move_base_handler
    wait_for(handler.get_goal_status_array, "move_base's status")
    sent = []
    for x in (2.0, 3.0):
        # its trap: a goal's nanoseconds must be later than those of the status before, also over a second's end
        for _ in range(10):
            goal = handler.navigate_to_pose(x, 0.5, 0.0, 0.1)
            if goal:
                break
        assert goal, (rig.seen("r1"), rig.robots["r1"].goals(), rig.robots["r1"].words(), handler.goal_status_array)
        sent.append(goal)
    assert {"goal 2 0.5", "goal 3 0.5"} <= set(rig.robots["r1"].goals())
    wait_for(lambda: handler.get_active_goal_status(), "the goal to be active")
    handler.stop_current_navigation()
    wait_for(lambda: "left 3" in rig.robots["r1"].goals(), "the cancel")
    wait_for(lambda: handler.get_goal_status(sent[-1]).status == 2, "PREEMPTED")
