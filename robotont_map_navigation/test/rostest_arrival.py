#!/usr/bin/env python3
"""navigation_monitor: what it sends beside move_base's commands."""

import math

import rospy
import rostest
from dynamic_reconfigure.srv import Reconfigure, ReconfigureResponse
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest, twist

MONITOR = places.program("robotont_map_navigation", "navigation_monitor")


class UnblockTest(NodeTest):
    """Its topic is remapped, as in navigation.launch."""

    def drive(self, seconds, moves):
        """Commands to strafe slowly, 10 per second, and the odometry of a robot that moves or does not."""
        measured = Odometry()
        measured.twist.twist.linear.y = 0.06 if moves else 0.0
        for _ in range(round(seconds * 10)):
            self.commands.publish(twist(y=0.0667))
            self.odometry.publish(measured)
            rospy.sleep(0.1)

    def test_zeros_go_out_only_while_the_robot_stands(self):
        log = self.processes.folder / "log"
        node = self.processes.start(MONITOR, "cmd_vel:=cmd_vel/navigation",
                                    log=log)
        self.commands = self.publisher("cmd_vel/navigation", Twist)
        self.odometry = self.publisher("odom", Odometry)
        heard = self.listen("cmd_vel/navigation", Twist)
        self.drive(2.5, moves=True)
        self.assertTrue(heard)
        self.assertNotIn(Twist(), heard)
        self.drive(2.5, moves=False)
        wait_for(lambda: Twist() in heard, "zeros")
        self.assertIn(heard.count(Twist()), (1, 2))
        self.assertEqual({math.copysign(1, message.linear.y) for message in heard}, {1.0})
        self.assertIn("a wheel blocked, at a wall", log.read_text())
        self.assertIsNone(node.poll())

    def test_nothing_is_sent_while_another_drives(self):
        driver = self.publisher("cmd_vel/driven_by", String, 0)
        self.processes.start(MONITOR, "cmd_vel:=cmd_vel/navigation")
        self.commands = self.publisher("cmd_vel/navigation", Twist)
        self.odometry = self.publisher("odom", Odometry)
        wait_for(driver.get_num_connections, "unblock's subscription")
        heard = self.listen("cmd_vel/navigation", Twist)
        for other in ("hand", "emergency stop"):
            driver.publish(other)
            self.drive(2.0, moves=False)
        self.assertNotIn(Twist(), heard)
        driver.publish("navigation")
        self.drive(2.5, moves=False)
        wait_for(lambda: Twist() in heard, "zeros")

    def test_the_goal_s_tolerance_is_wide_from_the_arrival_to_the_goal_s_end(self):
        heard = []

        def reconfigure(request):
            heard.extend((each.name, each.value) for each in request.config.doubles)
            return ReconfigureResponse()
        service = rospy.Service("move_base/DWAPlannerROS/set_parameters", Reconfigure, reconfigure)
        self.addCleanup(service.shutdown)
        self.processes.start(MONITOR)
        goal = self.publisher("move_base/current_goal", PoseStamped)
        feedback = self.publisher("move_base/feedback", MoveBaseActionFeedback)
        result = self.publisher("move_base/result", MoveBaseActionResult)
        narrow, wide = ("xy_goal_tolerance", 0.03), ("xy_goal_tolerance", 0.06)
        message, place = PoseStamped(), MoveBaseActionFeedback()
        message.pose.position.x = 2.0
        for end, so_far in ((result, MoveBaseActionResult()), (goal, message)):
            heard.clear()
            goal.publish(message)
            for x in (1.0, 1.96, 1.98, 1.96):
                place.feedback.base_position.pose.position.x = x
                feedback.publish(place)
                rospy.sleep(0.1)
            wait_for(lambda: heard[-1:] == [wide], "the arrival")
            end.publish(so_far)
            wait_for(lambda: heard[-1] == narrow, "the goal's end, or the next one")
            self.assertEqual([each for each in heard if each == wide], [wide])


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "unblock", UnblockTest)
