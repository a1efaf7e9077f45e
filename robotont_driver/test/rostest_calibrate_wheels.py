#!/usr/bin/env python3
"""The guide of calibrate_wheels, with a driver and a board that is not there, as a user who types answers."""

import subprocess

import rostest
import yaml
from nav_msgs.msg import Odometry

from board import Board
from harness import wait_for
from node_test import WHEEL_PARAMS, NodeTest

SIZES = ("--side", "0.2", "--turns", "0.25", "--line", "0.3")


class GuideTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.board = Board(str(self.processes.folder / "board"), 3)
        self.board.plug()
        self.addCleanup(self.board.__exit__)
        odom = self.listen("odom", Odometry)
        self.processes.launch("robot.launch", f"port:={self.board.link}", "description:=false")
        wait_for(lambda: odom, "odometry")

    def guide(self, answers, *arguments):
        """(exit status, all that it says) of a guided calibration with these answers, one a line."""
        folder = self.processes.folder
        command = ["rosrun", "robotont_driver", "calibrate_wheels", "--guide", str(folder / "runs"), *SIZES,
                   "--wheel-params", str(WHEEL_PARAMS), "-o", str(folder / "new.yaml"),
                   "--picture", str(folder / "new.png"), *arguments]
        done = subprocess.run(command, input="\n".join(answers).encode(), stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=60, check=False)
        return done.returncode, done.stdout.decode()

    def test_a_tape_for_a_line_and_a_turn_and_a_square_left_out(self):
        told = ["s", "s", "", "0 0 ninety", "0 0 90", "s", "", "0.0, 0.3, 0", "q"]
        status, output = self.guide(told, "--angles", "fixed")
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

    def test_a_topic_that_knows_the_truth_and_a_run_by_hand(self):
        status, output = self.guide(["s", "s", "", "s", "m", "", "q"], "--truth", "odom", "--angles", "fixed")
        # a run in which nothing moved tells nothing
        self.assertEqual(status, 1, output)
        self.assertIn("found no packets with motion", output)
        status, output = self.guide(["s", "s", "", "s", "", "q"], "--truth", "odom", "--angles", "fixed")
        self.assertEqual(status, 0, output)
        found = yaml.safe_load((self.processes.folder / "new.yaml").read_text())
        self.assertAlmostEqual(found["wheelRadius"], 0.035, delta=1e-4)

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
    rostest.rosrun("robotont_driver", "calibrate_wheels", GuideTest)
