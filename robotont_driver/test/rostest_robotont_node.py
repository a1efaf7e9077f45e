#!/usr/bin/env python3
"""robotont_node against the three processes: the same on the wire, the same odometry; and what differs."""

import math
import random
import signal

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_driver.kinematics.se2 import pose_of
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, NodeTest, twist
from robotont_testing.stand_in_board import Board

PARTS = ("driver_node", "serial_com_node", "odom_node")


class RobotontNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.log = self.processes.folder / "log"
        self.board = Board(str(self.processes.folder / "board"))
        self.addCleanup(self.board.__exit__)
        self.board.plug()
        for name in ("robotont_node", *PARTS):
            if rospy.has_param(name):
                rospy.delete_param(name)
        rospy.set_param("serial_com_node/port", str(self.board.link))

    def start(self):
        self.odom = self.listen("odom", Odometry)
        self.node = self.processes.node("robotont_node", f"__log:={self.log}.file", log=self.log)
        wait_for(lambda: self.odom, "odometry")

    def drive(self, metres):
        """Until the odometry has gone so far."""
        command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or self.odom[-1].pose.pose.position.x > metres, "motion",
                 period=0.02)

    def test_other_processes_get_copies_and_the_last_packet_is_a_stop(self):
        written, read = self.listen("serial_write", String), self.listen("serial_read", String)
        self.start()
        wait_for(lambda: len(written) > 5 and len(read) > 5, "copies for other processes")
        self.assertEqual({message.data for message in written}, {"0.00:0.00:0.00;\n"})
        self.assertEqual({message.data.partition(";")[0] for message in read}, {"0:0:0"})
        numbers = [int(message.data.split(";")[1]) for message in read]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))), "no packet is missing")
        self.drive(0.1)
        for task in ("serial_com_node: link", "serial_com_node: board", "odom_node: wheel feedback",
                     "odom_node: stamps"):
            self.wait_for_status(task, OK)
        self.values("driver_node: command stream")
        subscribers = dict(rospy.get_master().getSystemState()[2][1])
        for topic in ("/serial_write", "/serial_read"):
            self.assertNotIn("/robotont_node", subscribers[topic], "packets of other processes would be taken")
        self.processes.stop(self.node, signal.SIGTERM)
        wait_for(lambda: self.board.heard[-1][1].partition(";")[0] in ("0.00:0.00:0.00", "0:0:0"), "the stop")
        self.assertNotIn("Traceback", self.log.read_text())

    def driven(self, names):
        """(packets on the wire, end of the odometry) of these nodes, for the same commands and the same counts."""
        rng = random.Random(5)
        script = iter([[rng.randint(-30, 30) for _ in range(3)] for _ in range(100)])
        odom = self.listen("odom", Odometry)
        nodes = [self.processes.node(name, log=self.processes.folder / name) for name in names]
        wait_for(lambda: odom, "odometry")
        self.board.motors.follow = lambda _: self.turn(next(script, (0, 0, 0)))
        command, packets = self.publisher("cmd_vel", Twist), [np.zeros(3)]

        def after(heard):
            """The first other packet than before; zeros are a time-out on a machine that is late with everything."""
            for _, line in self.board.heard[heard:]:
                packet = np.array(line.partition(";")[0].split(":"), float)
                if packet.any() and np.abs(packet - packets[-1]).max() > 0.5:
                    return packet
            return None
        for _ in range(20):
            heard, wanted = len(self.board.heard), twist(*(rng.uniform(-0.5, 0.5) for _ in range(3)))
            wait_for(lambda heard=heard, wanted=wanted: command.publish(wanted) or after(heard) is not None,
                     "the packet", period=0.02)  # one that comes to a node which was starved does not drive
            packets.append(after(heard))
        wait_for(lambda: not any(self.board.reported[-1]), "all counts")
        ended = rospy.Time.now() + rospy.Duration(0.1)
        wait_for(lambda: odom[-1].header.stamp > ended, "their odometry")
        for node in nodes:
            self.processes.stop(node, signal.SIGTERM)
        return packets, pose_of(odom[-1].pose.pose)

    def test_wire_and_odometry_are_those_of_the_three_processes(self):
        self.turn = self.board.motors.follow
        (packets, pose), (packets_of_three, pose_of_three) = self.driven(["robotont_node"]), self.driven(PARTS)
        np.testing.assert_allclose(packets, packets_of_three, rtol=0, atol=0.011)
        self.assertGreater(abs(pose[2]), 0.01)
        self.assertEqual(pose, pose_of_three)

    def test_wrong_parameters_of_all_parts_are_listed_at_once(self):
        rospy.set_param("driver_node/publish_rat", 20.0)
        rospy.set_param("serial_com_node/packets", "maybe")
        rospy.set_param("odom_node/publish_tf", 5)
        node = self.processes.node("robotont_node", log=self.log)
        wait_for(lambda: node.poll() is not None, "the end of robotont_node", timeout=30)
        log = self.log.read_text()
        self.assertEqual(node.returncode, 1, log)
        for words in ("/driver_node: ~publish_rat: no such parameter; did you mean ~publish_rate?",
                      "/serial_com_node: ~packets: found 'maybe'", "/odom_node: ~publish_tf: found 5"):
            self.assertIn(words, log)

    def test_a_node_that_comes_after_a_killed_one_goes_on_from_its_pose(self):
        self.start()
        self.drive(0.2)
        self.processes.stop(self.node, signal.SIGKILL)
        wait_for(lambda: not any(self.board.speeds), "the board's own time-out")
        before = self.odom[-1].pose  # all has come by now
        self.start()
        after = self.odom[0].pose
        self.assertAlmostEqual(after.pose.position.x, before.pose.position.x, delta=0.01)
        self.assertGreater(math.sqrt(after.covariance[0]), 0.15, "the way that nobody counted")
        self.assertIn("goes on from where it was", self.log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "robotont_node_test", RobotontNodeTest)
