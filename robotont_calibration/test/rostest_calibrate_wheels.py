#!/usr/bin/env python3
"""The guide of calibrate_wheels, with the driver and a stand-in board, as a user who types answers."""

import os
import select
import signal
import subprocess

import rostest
from nav_msgs.msg import Odometry

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import WHEEL_PARAMS
from robotont_testing.stand_in_board import Board


class GuideTest(NodeTest):
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

    def test_a_topic_of_the_truth_and_ctrl_c_in_a_run_and_at_a_question(self):
        folder, odom = self.processes.folder, self.listen("odom", Odometry)
        board = Board(str(folder / "board"), 3)
        board.plug()
        self.addCleanup(board.close)
        self.processes.launch("robot.launch", f"port:={board.link}", "description:=false")
        wait_for(lambda: odom, "odometry", timeout=60)
        process = subprocess.Popen(
            [places.program("robotont_calibration", "calibrate_wheels"), "--guide", str(folder / "runs"),
             "--truth", "odom", "--angles", "fixed", "--side", "0.2", "--turns", "0.25", "--line", "0.3",
             "--wheel-params", str(WHEEL_PARAMS), "-o", str(folder / "new.yaml")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, bufsize=0, start_new_session=True)
        self.addCleanup(process.kill)
        process.stdin.write(b"s\ns\n\n\n")  # a spin that is made, and one that is to be stopped
        kept = folder / "runs" / "runs.txt"
        wait_for(kept.exists, "the first spin")
        wait_for(lambda: any(board.speeds), "the second spin")
        output = "".join(self.until_it_asks(process) for _ in range(4))
        os.killpg(process.pid, signal.SIGINT)
        wait_for(lambda: not any(board.speeds), "a robot that stands", timeout=2.0)
        output += self.until_it_asks(process)
        self.assertIn("Stopped by Ctrl-C. This run does not count", output)
        os.killpg(process.pid, signal.SIGINT)  # no more runs
        output += process.communicate(timeout=60)[0].decode()
        self.assertNotIn("Traceback", output)
        self.assertEqual(process.returncode, 4, output)  # one spin determines neither radius nor distance
        self.assertEqual(kept.read_text().split()[:2], ["--packets=serial_read", "--truth=odom"])
        self.assertEqual(len(kept.read_text().split()), 3)
        self.assertFalse((folder / "new.yaml").exists())


if __name__ == "__main__":
    rostest.rosrun("robotont_calibration", "calibrate_wheels", GuideTest)
