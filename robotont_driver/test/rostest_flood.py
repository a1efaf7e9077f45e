#!/usr/bin/env python3
"""Stops behind a flood of commands, on a line of 115200 baud."""

import sys
import time

import rostest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.stand_in_board import Board, speeds_of

BYTE_RATE = 11520  # [bytes/s] of a line of 115200 baud
STOP_WITHIN = 0.1  # [s]

SENDER = """
import sys, time, rospy
from geometry_msgs.msg import Twist
rospy.init_node("flood", anonymous=True)
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
message = Twist()
begun, number = time.monotonic(), 0
while not rospy.is_shutdown():
    message.linear.x = 0.2 + 0.001 * (number % 100)
    publisher.publish(message)
    number += 1
    time.sleep(max(0.0, begun + number / float(sys.argv[1]) - time.monotonic()))
"""


class FloodTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        robot = Processes()
        cls.addClassCleanup(robot.close)
        cls.board = Board(str(robot.folder / "board"))
        cls.board.byte_rate = BYTE_RATE
        cls.board.plug()
        cls.addClassCleanup(cls.board.__exit__)
        robot.node("serial_com_node", f"_port:={cls.board.link}")

    def setUp(self):
        super().setUp()
        self.button = self.publisher("emergency_stop", Bool)
        self.command = self.publisher("cmd_vel", Twist)
        self.let_go_and_drive(self.command, lambda: any(self.board.speeds), 0.1)

    def test_the_emergency_stop_is_not_late_behind_a_flood(self):
        for rate in (1000, 5000):  # [Hz]
            heard = len(self.board.heard)
            sender = self.processes.start(sys.executable, "-c", SENDER, str(rate))
            wait_for(lambda heard=heard: len(self.board.heard) > heard + 800, "the flood")
            pressed = time.monotonic()
            self.button.publish(True)
            wait_for(lambda: not any(self.board.speeds), "the stop")
            time.sleep(0.5)  # in which no command of the flood may drive
            moved_at = max(at for at, line in list(self.board.heard) if any(speeds_of(line.encode(), 3)))
            print(f"emergency stop behind {rate} commands/s: {1000 * (moved_at - pressed):.0f} ms")
            self.assertLess(moved_at - pressed, STOP_WITHIN)
            self.assertFalse(any(self.board.speeds))
            self.processes.stop(sender)
            self.button.publish(False)
            self.let_go_and_drive(self.command, lambda: any(self.board.speeds), 0.1)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "flood_test", FloodTest)
