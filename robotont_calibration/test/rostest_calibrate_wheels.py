#!/usr/bin/env python3
"""The guide of calibrate_wheels, with the driver and a stand-in board, as a user who types answers."""

import math
import os
import select
import signal
import subprocess
import sys

import rospy
import rostest
import yaml
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_driver.kinematics.se2 import between, pose_of, wrap
from robotont_driver.robots.robot_folder import shipped
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import ROBOTONT2_PARAMS, WHEEL_PARAMS
from robotont_testing.stand_in_board import Board


class Guide(NodeTest):
    @classmethod
    def setUpClass(cls):
        """A robot that all tests share: its start is most of a test's time."""
        super().setUpClass()
        cls.robot = Processes()
        cls.addClassCleanup(cls.robot.close)
        cls.board = Board(str(cls.robot.folder / "board"), 3)
        cls.board.plug()
        cls.addClassCleanup(cls.board.close)
        cls.robot.launch("robot.launch", f"port:={cls.board.link}", "description:=false")

    def setUp(self):
        super().setUp()
        self.odom = self.listen("odom", Odometry)
        wait_for(lambda: self.odom and not any(self.board.speeds), "odometry of a robot that stands", timeout=60)

    def place(self):
        """(x [m], y [m], yaw [rad]) by the odometry, which is right: the board's motors are ideal."""
        return pose_of(self.odom[-1].pose.pose)

    @staticmethod
    def until_it_asks(process):
        """All that a guided calibration prints up to its next question, that included."""
        printed = ""
        while not printed.endswith(("no more runs. ", "e.g. 0.03 -0.05 2: ")):
            waiting, _, _ = select.select([process.stdout], [], [], 60.0)
            byte = process.stdout.read(1).decode() if waiting else ""
            assert byte, f"no such question in {printed!r}"
            printed += byte
        return printed

    def begin(self, *arguments, **environment):
        """A guided calibration that waits for answers."""
        folder = self.processes.folder
        command = [places.program("robotont_calibration", "calibrate_wheels"), "--guide", str(folder / "runs"),
                   "--side", "0.2", "--turns", "0.25", "--line", "0.3", "--wheel-params", str(WHEEL_PARAMS),
                   "-o", str(folder / "new.yaml"), *arguments]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   bufsize=0, start_new_session=True, env={**os.environ, **environment})
        self.addCleanup(process.kill)
        return process


class GuideTest(Guide):
    def test_a_topic_of_the_truth_and_ctrl_c_in_a_run_and_at_a_question(self):
        process = self.begin("--truth", "odom", "--angles", "fixed")
        process.stdin.write(b"s\ns\n\n\n")  # a spin that is made, and one that is to be stopped
        kept = self.processes.folder / "runs" / "runs.txt"
        wait_for(kept.exists, "the first spin")
        wait_for(lambda: any(self.board.speeds), "the second spin")
        output = "".join(self.until_it_asks(process) for _ in range(4))
        os.killpg(process.pid, signal.SIGINT)
        wait_for(lambda: not any(self.board.speeds), "a robot that stands", timeout=2.0)
        output += self.until_it_asks(process)
        self.assertIn("Stopped by Ctrl-C. This run does not count", output)
        os.killpg(process.pid, signal.SIGINT)  # no more runs
        output += process.communicate(timeout=60)[0].decode()
        self.assertNotIn("Traceback", output)
        self.assertEqual(process.returncode, 4, output)  # one spin determines neither radius nor distance
        self.assertEqual(kept.read_text().split()[:2], ["--packets=serial_read", "--truth=odom"])
        self.assertEqual(len(kept.read_text().split()), 3)
        self.assertFalse((self.processes.folder / "new.yaml").exists())


class NightlyGuideTest(Guide):
    """Once a day."""

    def test_a_tape_for_a_line_and_a_turn_and_a_square_left_out(self):
        """"?" measures: where the robot stands, seen from where it stood at the last Enter."""
        process = self.begin("--angles", "fixed")
        output, start = "", None
        for answer in ("s", "s", "", "0 0 ninety", "?", "s", "", "?", "q"):
            output += self.until_it_asks(process)
            typed = answer
            if answer == "":
                start = self.place()
            elif answer == "?":
                x, y, yaw = between(start, self.place())
                typed = f"{x:.3f} {y:.3f} {math.degrees(wrap(yaw)):.1f}"
            process.stdin.write(typed.encode() + b"\n")
        output += process.communicate(timeout=60)[0].decode()
        self.assertEqual(process.returncode, 0, output)
        self.assertIn("Run 3 of 6: 0.25 turns on the spot, counterclockwise", output)
        self.assertIn("found '0 0 ninety', allowed: X,Y,YAW", output)
        folder = self.processes.folder
        found = yaml.safe_load((folder / "new.yaml").read_text())
        # the board's motors are ideal, so the old parameters are right but for what the tape leaves open
        self.assertAlmostEqual(found["wheelRadius"], 0.035, delta=0.0005)
        self.assertAlmostEqual(found["wheelDistanceFromCenter"], 0.125, delta=0.002)
        self.assertEqual(len((folder / "runs" / "runs.txt").read_text().split()), 3)
        self.assertFalse(any(self.board.speeds))

    def test_what_cannot_begin_says_why(self):
        """Each in a process of its own, all at once."""
        rospy.set_param("/elsewhere", yaml.safe_load(WHEEL_PARAMS.read_text()))  # packets without a driver
        self.listen("serial_read", String, rospy.Publisher("/elsewhere/serial_read", String, queue_size=1).publish)
        elsewhere = self.begin("--packets", "/elsewhere/serial_read")
        cases = [("for a node that takes commands on /elsewhere/cmd_vel", elsewhere, b"\n"),
                 (f"--wheel-params {(shipped() / 'thesis').resolve() / 'wheel_params.yaml'}",
                  self.begin("--wheel-params", str(ROBOTONT2_PARAMS)), b"\n"),
                 ("found no topic nowhere", self.begin("--truth", "nowhere"), b"q\n"),
                 ("for packets on nothing; is the robot running?", self.begin("--packets", "nothing"), b"q\n"),
                 ("found the end of the input", self.begin(), b"s\n")]
        for words, process, answers in cases:
            output = process.communicate(answers, timeout=60)[0].decode()
            self.assertEqual(process.returncode, 1, output)
            self.assertIn(words, output)
            self.assertNotIn("Traceback", output)
        self.assertFalse((self.processes.folder / "runs" / "runs.txt").exists())


if __name__ == "__main__":
    rostest.rosrun("robotont_calibration", "calibrate_wheels", NightlyGuideTest if "nightly" in sys.argv else GuideTest)
