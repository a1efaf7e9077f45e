#!/usr/bin/env python3
"""Launch files, frames, joints and parameters under the official stack's names, on an official board."""

import math

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest, twist
from robotont_testing.official_boards import Robotont2Board
from robotont_testing.rviz_stage import Stage

BRINGUP = """<launch>
  <arg name="__ns" default=""/>
  <include file="$(find robotont_driver)/launch/driver_basic.launch"><arg name="__ns" value="$(arg __ns)"/></include>
  <include file="$(find robotont_description)/launch/upload_description.launch">
    <arg name="__ns" value="$(arg __ns)"/>
  </include>
  <node name="joint_state_publisher" pkg="joint_state_publisher" type="joint_state_publisher"/>
  <node name="robot_state_publisher" pkg="robot_state_publisher" type="robot_state_publisher"/>
  <param name="serial/port" value="{port}"/>
</launch>"""


class OfficialNamesTest(NodeTest):
    def start(self, namespace=""):
        """The stack as robotont_support starts it."""
        self.prefix = namespace + "/" if namespace else ""
        self.port = BoardPort(str(self.processes.folder / "board"), lambda now: Robotont2Board(Motors(), start=now))
        self.addCleanup(self.port.unplug)
        self.port.plug()
        file = self.processes.folder / "bringup.launch"
        file.write_text(BRINGUP.format(port=self.port.link))
        self.odom = self.listen(f"/{self.prefix}odom", Odometry)
        self.joints = self.listen(f"/{self.prefix}joint_states", JointState)
        self.parents = {}
        self.listen("/tf", TFMessage, self.on_tf)
        self.listen("/tf_static", TFMessage, self.on_tf)
        arguments = [f"__ns:={namespace}"] if namespace else []
        self.processes.start("roslaunch", file, *arguments, log=self.processes.folder / "log")
        wait_for(lambda: self.odom and self.joints, "odometry and joints", timeout=60)

    def on_tf(self, message):
        for transform in message.transforms:
            self.parents.setdefault(transform.child_frame_id, set()).add(transform.header.frame_id)

    def check(self, namespace=""):
        self.start(namespace)
        prefix = self.prefix
        command = self.publisher(f"/{prefix}cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or self.odom[-1].pose.pose.position.x > 0.2, "motion", period=0.02)
        self.assertEqual((self.odom[-1].header.frame_id, self.odom[-1].child_frame_id),
                         (prefix + "odom", prefix + "base_footprint"))
        wait_for(lambda: len(self.parents) > 4, "the tree")
        self.assertTrue(all(len(parents) == 1 for parents in self.parents.values()), self.parents)
        self.assertEqual(self.parents[prefix + "base_footprint"], {prefix + "odom"})
        self.assertEqual(self.parents[prefix + "base_link"], {prefix + "base_footprint"})
        names = [prefix + f"rim_{name}_joint" for name in ("left", "back", "right")]
        self.assertEqual(sorted(self.joints[-1].name), sorted(names))

        def turned():
            angles = dict(zip(self.joints[-1].name, self.joints[-1].position))
            left, back, right = (angles[name] for name in names)
            return left < -4 and right > 4 and abs(back) < 0.5
        wait_for(lambda: command.publish(twist(0.2)) or turned(), "the wheels of the model", period=0.02)
        return command

    def test_as_robotont_support_starts_it(self):
        self.check()
        self.assertIn("rim_back_joint", rospy.get_param("/robot_description"))

    def test_in_a_namespace(self):
        self.check("robotont")
        self.assertIn("robotont/rim_back_joint", rospy.get_param("/robotont/robot_description"))

    def test_the_fake_driver(self):
        text = "<launch><include file='$(find robotont_driver)/launch/fake_driver.launch'/></launch>"
        file = self.processes.folder / "fake.launch"
        file.write_text(text)
        odom = self.listen("/odom", Odometry)
        for node in ("driver_node", "odom_node"):
            if rospy.has_param("/" + node):
                rospy.delete_param("/" + node)
        stage = Stage()  # RViz needs a screen, and its end ends the others
        self.addCleanup(stage.close)
        stage.show(file, log=self.processes.folder / "log")
        command = self.publisher("/cmd_vel", Twist)

        def driven():
            command.publish(twist(0.2, 0.0, 0.0))
            return odom and odom[-1].pose.pose.position.x > 0.1
        wait_for(driven, "motion", timeout=30, period=0.02)
        self.assertEqual(odom[-1].child_frame_id, "base_footprint")
        self.assertLess(math.hypot(odom[-1].pose.pose.position.y, odom[-1].pose.pose.position.x - 0.1), 0.1)


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "official_names_test", OfficialNamesTest)
