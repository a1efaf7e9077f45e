#!/usr/bin/env python3
"""status and report beside the real stack."""

import contextlib
import os
import signal
import subprocess
import tarfile

import rospy
import rostest

from robotont_driver.ros.version import version
from robotont_testing import places
from robotont_testing.harness import START, wait_for
from robotont_testing.node_test import OK, NodeTest
from robotont_testing.stand_in_board import Board


class StatusTest(NodeTest):
    def run_tool(self, name, *arguments, **environment):
        script = places.package("robotont_operations") / "scripts" / name
        return subprocess.run(["/usr/bin/python3", script, *map(str, arguments)], check=False, text=True,
                              timeout=60, capture_output=True, env={**os.environ, **environment})

    def test_a_robot_from_well_to_dead(self):
        board = Board(str(self.processes.folder / "board"))
        board.plug()
        self.addCleanup(board.close)
        self.processes.launch("robot.launch", f"port:={board.link}", "description:=false")
        self.wait_for_status("serial_com_node: link", OK)
        self.wait_for_status("odom_node: wheel feedback", OK)
        self.a_report_has_the_graph_and_own_parameters()
        done = self.run_tool("status")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for words in ("nodes", "link", "board", "command stream", f"config/robots/thesis, version {version()}",
                      "packets/s, checked"):
            self.assertIn(words, done.stdout)
        for uri, words in (("http://127.0.0.1:9", "no ROS master"),
                           (self.processes.uri.replace("http:", "https:"), "allowed: http://HOST:PORT")):
            done = self.run_tool("status", ROS_MASTER_URI=uri)
            self.assertEqual(done.returncode, 3)
            self.assertIn(words, done.stderr)
        pid = self.processes.pid("/serial_com_node")
        os.kill(pid, signal.SIGKILL)

        def is_back():
            with contextlib.suppress(OSError):
                return self.processes.pid("/serial_com_node") != pid
        wait_for(is_back, "serial_com_node", START)
        self.assertIn("restarts of /serial_com_node: 1", self.run_tool("status").stdout)

    def a_report_has_the_graph_and_own_parameters(self):
        """What is in its other parts, and what is not, test_report has."""
        rospy.set_param("/web_teleop/token", "hunter22")
        output = self.processes.folder / "out.tar.gz"
        done = self.run_tool("report", "--output", output, ROS_LOG_DIR=str(self.processes.folder))
        self.assertEqual(done.returncode, 0, done.stderr)
        with tarfile.open(str(output)) as archive:
            found = {member.name: archive.extractfile(member).read() for member in archive if member.isfile()}
        for name, words in (("ros/parameters.yaml", b"wheelRads"), ("ros/graph.yaml", b"/serial_com_node"),
                            ("versions/stack.txt", b"robotont_driver")):
            self.assertIn(words, found["out/" + name])
        self.assertFalse([name for name, data in found.items() if b"hunter22" in data])


if __name__ == "__main__":
    rostest.rosrun("robotont_operations", "status_test", StatusTest)
