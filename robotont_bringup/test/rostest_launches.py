#!/usr/bin/env python3
"""Launch files with robots of other kinds: two in namespaces, without a board's counts, under the official names."""

import importlib.util
import re
import sys

import numpy as np
import rosgraph
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from roslaunch.config import load_config_default
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from robotont_boards import Robotont2Board
from robotont_testing import places
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import START, wait_for
from robotont_testing.node_test import OK, NodeTest, twist
from robotont_testing.robots import SHIPPED, robot_folder
from robotont_testing.stand_in_board import Board

ROBOTONT_MSGS = importlib.util.find_spec("robotont_msgs")
UNEVEN = {**SHIPPED, "wheelAmount": 4, "wheelRads": [0.1, 1.4, 3.3, 5.0]}
# What the makers' and their students' programs send and hear: docs/robots.md.
SENT = {"/cmd_vel": "geometry_msgs/Twist", "/led_pixel": "robotont_msgs/LedModulePixel",
        "/led_segment": "robotont_msgs/LedModuleSegment"}
HEARD = {"/odom": "nav_msgs/Odometry", "/range": "sensor_msgs/Range", "/tf": "tf2_msgs/TFMessage",
         "/joint_states": "sensor_msgs/JointState", "/power_supply": "robotont_msgs/PowerSupply"}
OFFICIAL = """<launch>
  <arg name="__ns" default=""/>
  <include file="$(find robotont_driver)/launch/driver_basic.launch"><arg name="__ns" value="$(arg __ns)"/></include>
  <include file="$(find robotont_description)/launch/upload_description.launch">
    <arg name="__ns" value="$(arg __ns)"/>
  </include>
  <node name="joint_state_publisher" pkg="joint_state_publisher" type="joint_state_publisher"/>
  <node name="robot_state_publisher" pkg="robot_state_publisher" type="robot_state_publisher"/>
  <param name="serial/port" value="{port}"/>
</launch>"""


class Launches(NodeTest):
    def setUp(self):
        super().setUp()
        for name in {"driver_node", "serial_com_node", "odom_node", "serial"} & set(rospy.get_param("/")):
            rospy.delete_param("/" + name)  # of the test before

    def topics(self, namespace=""):
        return (self.listen(f"{namespace}/odom", Odometry), self.listen(f"{namespace}/joint_states", JointState),
                self.publisher(f"{namespace}/cmd_vel", Twist, subscribers=0))

    def drive(self, command, odom, speeds, until, what="motion"):
        """Command at 50 Hz until until(x, y) of the newest odometry."""
        def there():
            command.publish(twist(*speeds))
            place = odom[-1].pose.pose.position if odom else None
            return place and until(place.x, place.y)
        wait_for(there, what, START, period=0.02)

    def board(self, name, wheels=3):
        board = Board(str(self.processes.folder / name), wheels)
        board.plug()
        self.addCleanup(board.close)
        return board

    def parents(self):
        """{frame: its parents in TF}, from now on."""
        parents = {}

        def on_tf(message):
            for transform in message.transforms:
                parents.setdefault(transform.child_frame_id, set()).add(transform.header.frame_id)
        for topic in ("/tf", "/tf_static"):
            self.listen(topic, TFMessage, on_tf)
        return parents


class LaunchesTest(Launches):
    def test_a_robot_in_a_namespace_does_not_affect_another_one(self):
        """One in one process; one in three, with four uneven wheels, on a bad line.

        By its name the first test: where a new node has the port of a dead one, rospy may take it for connected.
        """
        boards = {"robot1": self.board("robot1"), "robot2": self.board("robot2", 4)}
        boards["robot2"].line.corrupt = 0.003
        folder = robot_folder(self.processes.folder / "robot", UNEVEN)
        robots = {name: self.topics("/" + name) for name in boards}
        frames = self.parents()
        for name, arguments in (("robot1", ["composed:=true"]), ("robot2", ["robot:=" + folder])):
            self.processes.launch("robot.launch", f"port:={boards[name].link}", f"namespace:=/{name}", *arguments)
        wait_for(lambda: all(odom and joints for odom, joints, _ in robots.values()), "both robots", START)
        (odom, joints, command), (other, _, other_command) = robots["robot1"], robots["robot2"]
        self.drive(command, odom, (0.4, 0, 0), lambda x, y: x > 0.2)
        self.assertFalse(any(boards["robot2"].motors.counted))
        self.drive(other_command, other, (0.2, -0.3, 0), lambda x, y: y < -0.3)
        position = other[-1].pose.pose.position
        np.testing.assert_allclose(position.x, -position.y * 2 / 3, atol=0.01)
        self.assertEqual((odom[-1].header.frame_id, odom[-1].child_frame_id), ("robot1/odom", "robot1/base_link"))
        self.assertEqual(joints[-1].name[0], "robot1/wheel_0_joint")
        wait_for(lambda: {"robot1/base_link", "robot2/base_link", "robot2/wheel_3_link"} <= set(frames), "the models")
        self.assertTrue(all(frame.startswith(("robot1/", "robot2/")) for frame in frames), frames)
        self.wait_for_status("robot2/odom_node: wheel feedback", OK)
        for name, board in boards.items():
            for task, hardware in {"cmd_vel_mux: who drives": name, "driver_node: command stream": name,
                                   "odom_node: wheel feedback": name, "serial_com_node: link": board.link}.items():
                self.values(f"{name}/{task}")
                self.assertEqual(self.status[f"{name}/{task}"].hardware_id, hardware)


class NightlyLaunchesTest(Launches):
    """Once a day."""

    def test_odometry_from_commands_launch(self):
        odom, _, command = self.topics()
        self.processes.launch("odometry_from_commands.launch")
        wait_for(lambda: odom, "odometry", START)
        start = rospy.get_time()
        self.drive(command, odom, (0.2, 0.1, 0), lambda x, y: x > 0.2)
        elapsed, place = rospy.get_time() - start, odom[-1].pose.pose.position
        self.assertAlmostEqual(place.y, place.x / 2, delta=1e-3)
        self.assertLessEqual(place.x, 0.2 * elapsed + 0.01)
        self.assertAlmostEqual(odom[-1].twist.twist.linear.x, 0.2, delta=1e-4)

    def test_the_official_stack_as_robotont_support_starts_it(self):
        port = BoardPort(str(self.processes.folder / "board"), lambda now: Robotont2Board(Motors(), start=now))
        self.addCleanup(port.unplug)
        port.plug()
        file = self.processes.folder / "bringup.launch"
        file.write_text(OFFICIAL.format(port=port.link))
        parents = self.parents()
        odom, joints, command = self.topics()
        self.processes.start("roslaunch", file, log=self.processes.folder / "log")
        self.drive(command, odom, (0.2, 0, 0), lambda x, y: x > 0.2)
        self.assertEqual((odom[-1].header.frame_id, odom[-1].child_frame_id), ("odom", "base_footprint"))
        wait_for(lambda: len(parents) > 4, "the tree")
        self.assertTrue(all(len(each) == 1 for each in parents.values()), parents)
        self.assertEqual((parents["base_footprint"], parents["base_link"]), ({"odom"}, {"base_footprint"}))
        names = [f"rim_{name}_joint" for name in ("left", "back", "right")]

        def turned():
            angles = dict(zip(joints[-1].name, joints[-1].position))
            left, back, right = (angles[name] for name in names)
            return left < -4 and right > 4 and abs(back) < 0.5
        self.drive(command, odom, (0.2, 0, 0), lambda x, y: turned(), "the wheels of the model")
        self.assertEqual(sorted(joints[-1].name), sorted(names))
        master = rosgraph.Master("/launches_test")
        types = dict(master.getTopicTypes())
        for wanted, users in zip((HEARD, SENT), master.getSystemState()):
            here = {name: kind for name, kind in wanted.items() if ROBOTONT_MSGS or "robotont_msgs" not in kind}
            self.assertEqual({name: types.get(name) for name in here}, here)
            self.assertEqual(here.keys() - {name for name, nodes in users if set(nodes) - {rospy.get_name()}}, set())
        # in a namespace all names have its prefix
        config = load_config_default([(str(file), ["__ns:=robotont"])], None)
        values = {str(parameter.value) for parameter in config.params.values()}
        self.assertLessEqual({"robotont/odom", "robotont/base_footprint", "robotont/base_link"}, values)
        self.assertTrue(any("robotont/rim_back_joint" in value for value in values))

    def test_the_official_fake_driver(self):
        odom, _, command = self.topics()
        package = places.package("robotont_driver")
        text = (package / "launch" / "fake_driver.launch").read_text().replace("$(dirname)/..", str(package))
        file = self.processes.folder / "fake_driver.launch"
        file.write_text(re.sub("<include.*</include>", "", text, flags=re.DOTALL))  # the model, with RViz
        self.processes.launch(file)
        self.drive(command, odom, (0.2, 0.1, 0), lambda x, y: x > 0.3)
        self.assertEqual((odom[-1].header.frame_id, odom[-1].child_frame_id), ("odom", "base_footprint"))
        rospy.ServiceProxy("/odom_reset", Empty)()
        wait_for(lambda: odom[-1].pose.pose.position.x < 0.2, "the origin")


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "launches_test", NightlyLaunchesTest if "nightly" in sys.argv else LaunchesTest)
