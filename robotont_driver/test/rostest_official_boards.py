#!/usr/bin/env python3
"""serial_com_node and boards with the official firmware behind pseudo-terminals."""

import time

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import BatteryState, Range
from std_msgs.msg import Float64, String
from tf2_msgs.msg import TFMessage

from robotont_boards import BOARDS
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import EDGES_PER_METRE, Motors
from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, NodeTest
from robotont_testing.robots import ROBOTONT2, SHIPPED

TASK = "serial_com_node: link"
DRIVE = "-18.90:0.00:18.90;\n"  # 0.2 m/s forward
DRIVE_LINE = b"MS:-0.1732:0.0000:0.1732\n"


class BoardTest(NodeTest):
    """serial_com_node and an official board at a port."""

    def setUp(self):
        super().setUp()
        for name in ("serial", "serial_com_node", "battery", *SHIPPED):
            if rospy.has_param("/" + name):
                rospy.delete_param("/" + name)
        for name, value in ROBOTONT2.items():
            rospy.set_param("/" + name, value)
        self.log = self.processes.folder / "log"
        self.port = BoardPort(str(self.processes.folder / "board"),
                              lambda now: BOARDS["robotont2"](Motors(), start=now))
        self.addCleanup(self.port.unplug)
        self.port.plug()

    def start(self, *arguments):
        self.node = self.processes.node("serial_com_node", "__name:=serial_com_node", *arguments, log=self.log)

    def wire(self):
        return b"".join(data for _, data in list(self.port.heard))

    def say(self, *lines, until):
        """Send lines again and again until a condition holds."""
        def said():
            self.port.board.extra_lines = list(lines)
            return until()
        wait_for(said, f"what follows from {lines}", period=0.1)


class OfficialBoardsTest(BoardTest):
    def counted(self):
        packets = [tuple(map(float, message.data.partition(";")[0].split(":"))) for message in list(self.read)]
        return [sum(column) for column in zip(*packets)]

    def drive(self, seconds):
        """Commands at 50 Hz, which is faster than the board takes them."""
        end = time.monotonic() + seconds
        wait_for(lambda: self.write.publish(DRIVE) or time.monotonic() > end, "the drive", period=0.02)

    def stand(self):
        wait_for(lambda: self.write.publish("0:0:0;\n") or max(map(abs, self.port.board.motors.speeds)) < 1e-4,
                 "the robot to stand", period=0.05)

    def test_generation_2_is_recognised_greeted_driven_and_taken_afresh(self):
        rospy.set_param("/battery", {"curve": [[13.1, 0.0], [14.4, 0.04], [14.5, 0.06]], "resistance": 0.1})
        rospy.set_param("/serial", {"port": self.port.link, "baudrate": 115200})  # the official parameter
        self.read, limits = self.listen("serial_read", String), self.listen("board_wheel_limit", Float64)
        self.start()
        self.write = self.publisher("serial_write", String)
        wait_for(lambda: self.read, "packets", timeout=10.0)
        wait_for(lambda: [message.data for message in limits] == [0.3], "what driver_node needs to know")
        before = len(self.port.heard)
        self.drive(2.0)
        starts = [at for at, _ in self.port.heard[before:]]
        self.assertGreater((starts[-1] - starts[0]) / (len(starts) - 1), 0.029)
        self.assertTrue(self.wire().startswith(b"\x1b"), self.wire()[:40])
        self.assertIn(DRIVE_LINE, self.wire())
        wait_for(lambda: self.wire().endswith(b"RS:0:0:0\n"), "the stop that silence makes", timeout=0.7)
        self.stand()
        # the board sums every second window: what it reported is what we published
        true = [path * EDGES_PER_METRE for path in self.port.board.odometry.summed]
        wait_for(lambda: max(map(abs, np.subtract(self.counted(), true))) <= 1, "every count")
        self.assertEqual(self.port.swallowed(), [])
        self.wait_for_status(TASK, OK, "packets/s")
        self.assertEqual(self.values(TASK)["packets"], "robotont2")
        self.check_readings()
        counted = self.counted()
        self.port.restart()
        wait_for(lambda: "restarted" in self.log.read_text(), "words in the log")
        self.port.unplug()
        self.wait_for_status(TASK, ERROR)
        self.port.heard.clear()
        self.port.plug()
        wait_for(lambda: self.wire().startswith(b"\x1b"), "the greeting")
        self.wait_for_status(TASK, OK)
        self.assertEqual(self.counted(), counted)
        self.port.heard.clear()
        self.processes.stop(self.node)
        wait_for(lambda: self.wire().endswith(b"RS:0:0:0\n"), "the last stop")

    def check_readings(self):
        """Ranges, battery, and where the sensors are."""
        ranges, battery = self.listen("range", Range), self.listen("battery", BatteryState)
        places = self.listen("/tf_static", TFMessage)
        self.say(b"RANGE:" + b":".join([b"1500"] * 12) + b"\r\n", b"POWER:1.5:14.25\r\n",
                 until=lambda: len(ranges) >= 24 and battery and places)
        self.assertEqual({message.header.frame_id for message in ranges}, {f"range_sensor_{n}" for n in range(12)})
        self.assertAlmostEqual(ranges[0].range, 1.5)
        self.assertAlmostEqual(battery[0].voltage, 14.25, places=5)
        self.assertAlmostEqual(battery[0].current, -1.5)
        self.assertAlmostEqual(battery[0].percentage, 0.04, places=5)  # 14.25 V, and what 1.5 A take of it
        self.wait_for_status("serial_com_node: board", ERROR, "the battery is empty, 4 %")
        front = next(t for t in places[0].transforms if t.child_frame_id == "range_sensor_11")
        self.assertAlmostEqual(front.transform.translation.x, 0.165)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "official_boards_test", OfficialBoardsTest)
