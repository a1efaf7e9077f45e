#!/usr/bin/env python3
"""odom_node with four wheels, one of which slips, and with three, one of which is blocked."""


import rospy
import rostest
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheels import read_wheels
from robotont_driver.protocol.packet import format_packet
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

FOUR = "odom_node: wheel feedback"
THREE = "three/odom_node: wheel feedback"


class OdomNodeSlipTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.odom = self.listen("odom", Odometry, publishers=1)
        self.three_odom = self.listen("/three/odom", Odometry, publishers=1)

    def drive(self, namespace, units, counts, packets):
        """A command and as many packets, as fast as odom_node takes them."""
        read = self.publisher(namespace + "serial_read", String)
        write = self.publisher(namespace + "serial_write", String)
        odom = self.three_odom if "three" in namespace else self.odom
        before = len(odom)
        write.publish(format_packet(units, 2))
        for _ in range(packets):
            read.publish(format_packet(counts))
        wait_for(lambda: len(odom) >= before + packets, "odometry")

    def status_of(self, name):
        """Diagnostics by the end of the name: the updater puts the node's full name before it."""
        return next((status for full, status in self.status.items() if full.lstrip("/") == name), None)

    def wait_for_words(self, name, level, words, keep_on):
        def matching():
            keep_on()
            status = self.status_of(name)
            return status and status.level == level and words in status.message and status
        return wait_for(matching, f"{words!r} in {name}: {self.status_of(name)}", timeout=30)

    def test_a_slipping_wheel_of_four_is_left_out_named_and_taken_back(self):
        units = Kinematics(read_wheels(rospy.get_param("/"))).units_of_twist((0.4, 0.0, 0.0))
        right = [round(unit) for unit in units]
        wrong = [round(1.4 * unit) if wheel == 2 else unit for wheel, unit in enumerate(right)]
        self.drive("/", units, right, 30)
        self.wait_for_words(FOUR, OK, "packets/s", lambda: self.drive("/", units, right, 5))
        self.drive("/", units, wrong, 12)
        self.assertAlmostEqual(self.odom[-1].twist.twist.linear.x, 0.4, delta=0.01)
        self.assertAlmostEqual(self.odom[-1].twist.twist.angular.z, 0.0, delta=0.03)
        status = self.wait_for_words(FOUR, WARN, "wheel 2 ", lambda: self.drive("/", units, wrong, 5))
        values = {value.key: value.value for value in status.values}
        self.assertEqual(values["wheels excluded"], "wheel 2")
        self.assertEqual(values["wheels excluded so far"], "1")
        self.assertIn("each other", values["wheels compared by"])
        self.wait_for_words(FOUR, OK, "packets/s", lambda: self.drive("/", units, right, 5))

    def test_of_three_wheels_a_blocked_one_is_named_from_its_command(self):
        units = Kinematics(read_wheels(rospy.get_param("/three"))).units_of_twist((0.0, 0.0, 2.0))
        right = [round(unit) for unit in units]
        blocked = [0 if wheel == 1 else unit for wheel, unit in enumerate(right)]
        self.wait_for_words(THREE, OK, "packets/s", lambda: self.drive("/three/", units, right, 5))
        status = self.wait_for_words(THREE, WARN, "wheel 1 does not turn as commanded",
                                     lambda: self.drive("/three/", units, blocked, 20))
        self.assertIn("with 3 wheels only command and measurement can be compared", status.message)
        values = {value.key: value.value for value in status.values}
        self.assertEqual(values["wheels compared by"], "command and measurement only")
        self.assertIn("wheel 1: part of the commanded path", values)
        self.wait_for_words(THREE, OK, "packets/s", lambda: self.drive("/three/", units, right, 20))


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "odom_node_slip_test", OdomNodeSlipTest)
