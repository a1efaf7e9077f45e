#!/usr/bin/env python3
"""The guide of calibrate_wheels, with the driver and a stand-in board, as a user who types answers."""

import math
import os
import select
import signal
import subprocess

import rostest
import yaml
from nav_msgs.msg import Odometry

from robotont_driver.kinematics.se2 import between, pose_of, wrap
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import WHEEL_PARAMS
from robotont_testing.stand_in_board import Board

SIZES = ("--side", "0.2", "--turns", "0.25", "--line", "0.3")


class GuideTest(NodeTest):
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

    def command(self, *arguments):
        """Words of the command line."""
        folder = self.processes.folder
        return [places.program("robotont_calibration", "calibrate_wheels"), "--guide", str(folder / "runs"), *SIZES,
                "--wheel-params", str(WHEEL_PARAMS), "-o", str(folder / "new.yaml"),
                "--picture", str(folder / "new.png"), *arguments]

    def guide(self, answers, *arguments):
        """(exit status, all that it prints) of a guided calibration with these answers, one a line."""
        done = subprocess.run(self.command(*arguments), input="\n".join(answers).encode(), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=60, check=False)
        return done.returncode, done.stdout.decode()

    def place(self):
        """(x [m], y [m], yaw [rad]) by the odometry, which is right: the board's motors are ideal."""
        pose = self.odom[-1].pose.pose
        return pose_of(pose)

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

    def with_a_tape(self, answers, *arguments):
        """As `guide`, but "?" measures: where the robot stands then, seen from where it stood at the last Enter."""
        process = subprocess.Popen(self.command(*arguments), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, bufsize=0)
        self.addCleanup(process.kill)
        output, start = "", None
        for answer in answers:
            output += self.until_it_asks(process)
            typed = answer
            if answer == "":
                start = self.place()
            elif answer == "?":
                x, y, yaw = between(start, self.place())
                typed = f"{x:.3f} {y:.3f} {math.degrees(wrap(yaw)):.1f}"
            process.stdin.write(typed.encode() + b"\n")
            process.stdin.flush()
        output += process.communicate(timeout=60)[0].decode()
        return process.returncode, output

    def test_a_tape_for_a_line_and_a_turn_and_a_square_left_out(self):
        answers = ["s", "s", "", "0 0 ninety", "?", "s", "", "?", "q"]
        status, output = self.with_a_tape(answers, "--angles", "fixed")
        self.assertEqual(status, 0, output)
        self.assertIn("Run 3 of 6: 0.25 turns on the spot, counterclockwise", output)
        self.assertIn("found '0 0 ninety', allowed: X,Y,YAW", output)
        folder = self.processes.folder
        found = yaml.safe_load((folder / "new.yaml").read_text())
        # the board's motors are ideal, so the old parameters are right but for what the tape leaves open
        self.assertAlmostEqual(found["wheelRadius"], 0.035, delta=0.0005)
        self.assertAlmostEqual(found["wheelDistanceFromCenter"], 0.125, delta=0.002)
        self.assertEqual(len((folder / "runs" / "runs.txt").read_text().split()), 2)
        self.assertFalse(any(self.board.speeds))

    def test_a_topic_of_the_truth_and_a_run_by_hand(self):
        status, output = self.guide(["s", "s", "", "s", "m", "", "q"], "--truth", "odom", "--angles", "fixed")
        # a run in which nothing moved determines nothing
        self.assertEqual(status, 1, output)
        self.assertIn("found no packets with motion", output)
        status, output = self.guide(["s", "s", "", "s", "", "q"], "--truth", "odom", "--angles", "fixed")
        self.assertEqual(status, 0, output)
        found = yaml.safe_load((self.processes.folder / "new.yaml").read_text())
        self.assertAlmostEqual(found["wheelRadius"], 0.035, delta=1e-4)

    def test_ctrl_c_stops_the_robot_and_keeps_the_runs_made(self):
        process = subprocess.Popen(self.command("--truth", "odom", "--angles", "fixed"), stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
        process.stdin.write(b"s\ns\n\n\n")  # a spin that is made, and one that is to be stopped
        process.stdin.flush()
        kept = self.processes.folder / "runs" / "runs.txt"
        wait_for(kept.exists, "the first spin", timeout=20.0)
        wait_for(lambda: any(self.board.speeds), "the second spin")
        os.killpg(process.pid, signal.SIGINT)
        wait_for(lambda: not any(self.board.speeds), "a robot that stands", timeout=2.0)
        output = process.communicate(b"q\n", timeout=60)[0].decode()
        self.assertIn("Stopped by Ctrl-C. This run does not count", output)
        self.assertNotIn("Traceback", output)
        self.assertEqual(process.returncode, 0, output)
        self.assertEqual(len(kept.read_text().split()), 1)

    def test_ctrl_c_at_a_question_means_no_more_runs(self):
        process = subprocess.Popen(self.command("--truth", "odom", "--angles", "fixed"), stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, bufsize=0, start_new_session=True)
        process.stdin.write(b"s\ns\n\n")  # a spin that is made
        process.stdin.flush()
        output = "".join(self.until_it_asks(process) for _ in range(4))
        os.killpg(process.pid, signal.SIGINT)
        output += process.communicate(timeout=60)[0].decode()
        self.assertEqual(process.returncode, 0, output)
        self.assertNotIn("Traceback", output)
        self.assertTrue((self.processes.folder / "new.yaml").exists())

    def test_a_robot_that_nobody_drives(self):
        folder = self.processes.folder
        done = subprocess.run(self.command("--packets", "/serial_read"), input=b"\n", stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=60, check=False,
                              env={**os.environ, "ROS_NAMESPACE": "elsewhere"})
        self.assertEqual(done.returncode, 1)
        self.assertIn("for a node that takes commands on /elsewhere/cmd_vel", done.stdout.decode())
        self.assertFalse((folder / "runs" / "runs.txt").exists())

    def test_nothing_to_calibrate_with(self):
        for answers, arguments, words in (
                (["q"], (), "found no run to calibrate with"),
                (["s"], (), "found the end of the input"),
                (["q"], ("--truth", "nowhere"), "found no topic nowhere"),
                (["q"], ("--packets", "nothing"), "for packets on nothing; is the robot running?")):
            status, output = self.guide(answers, *arguments)
            self.assertEqual(status, 1, output)
            self.assertIn(words, output)
            self.assertNotIn("Traceback", output)


if __name__ == "__main__":
    rostest.rosrun("robotont_calibration", "calibrate_wheels", GuideTest)
