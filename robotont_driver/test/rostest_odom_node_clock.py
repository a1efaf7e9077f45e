#!/usr/bin/env python3
"""odom_node on a simulated clock that jumps: nothing falls silent, stamps follow, the diagnostics say so."""

import rospy
import rostest
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from robotont_driver.protocol.packet import format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

TASK = "odom_node: stamps"
PERIOD = 0.02  # [s]
MOVE = (-10, 0, 10)


class OdomNodeClockTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.odom = self.listen("odom", Odometry)
        self.transforms = self.listen("/tf", TFMessage)
        self.joints = self.listen("joint_states", JointState)
        self.clock = self.publisher("/clock", Clock)
        self.read = self.publisher("serial_read", String)
        self.time = 5000.0
        wait_for(self.answers, "odometry")
        self.drive(20)

    def answers(self):
        """Whether one packet brings one message of each topic: until all are connected, some are lost."""
        topics = (self.odom, self.transforms, self.joints)
        for messages in topics:
            messages.clear()
        self.time += PERIOD
        self.clock.publish(Clock(rospy.Time.from_sec(self.time)))
        self.read.publish(format_packet(MOVE))
        try:
            return wait_for(lambda: all(topics), "an answer", timeout=1.0)
        except AssertionError:
            return False

    def drive(self, packets):
        """Stamps [s] of the odometry of so many packets, each of which is waited for; of TF and joint states, too."""
        for messages in (self.odom, self.transforms, self.joints):
            messages.clear()
        for number in range(1, packets + 1):
            self.time += PERIOD
            self.clock.publish(Clock(rospy.Time.from_sec(self.time)))
            wait_for(lambda: abs(rospy.get_time() - self.time) < 1e-6, "the clock")
            self.read.publish(format_packet(MOVE))
            wait_for(lambda number=number: all(
                len(messages) >= number for messages in (self.odom, self.transforms, self.joints)),
                "odometry, transform and joint state of each packet")
        stamps = [message.header.stamp.to_sec() for message in self.odom]
        self.assertEqual(stamps, [message.header.stamp.to_sec() for message in self.joints])
        self.assertEqual(stamps, [message.transforms[0].header.stamp.to_sec() for message in self.transforms])
        return stamps

    def test_the_clock_jumps(self):
        for jump, words in ((3600.0, None), (0.2, None), (-80.0, "the clock was set back by 80 s")):
            self.time += jump
            wait_for(lambda: abs(self.drive(1)[0] - self.time) < 0.1, "the clock, which the node gets separately")
            stamps = self.drive(30)  # of each packet, so no gap in the odometry
            situation = f"after a jump of {jump} s, now {self.time}: {stamps}"
            self.assertLessEqual(max(stamps), self.time + 1e-3, situation)
            # on a busy machine packets may overtake the clock, which the node then finds standing: they count as late
            stood = sum(new - old < PERIOD / 2 for old, new in zip(stamps, stamps[1:]))
            self.assertLess(abs(stamps[-1] - self.time), 0.045 + stood * PERIOD, situation)
            self.assertTrue(all(new > old for old, new in zip(stamps[2:], stamps[3:])), situation)
            if words:
                self.wait_for_status(TASK, WARN, words)
        self.drive(round(11.0 / PERIOD))
        self.wait_for_status(TASK, OK, "by packet number and arrival")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_clock_test", OdomNodeClockTest)
