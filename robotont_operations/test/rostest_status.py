#!/usr/bin/env python3
"""status and report beside the real stack."""

import contextlib
import os
import signal
import subprocess
import sys
import tarfile

import rosbag
import rospy
import rostest

from robotont_operations.black_box_files import bags_of, runs_in
from robotont_testing import places
from robotont_testing.harness import START, Processes, suspended, wait_for
from robotont_testing.node_test import OK, NodeTest
from robotont_testing.stand_in_board import Board


class StackTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.robot = Processes()
        cls.board = Board(str(cls.robot.folder / "board"))
        cls.board.plug()
        cls.robot.launch("robot.launch", f"port:={cls.board.link}", "description:=false")

    @classmethod
    def tearDownClass(cls):
        cls.board.__exit__()
        cls.robot.close()

    def setUp(self):
        super().setUp()
        self.wait_for_status("serial_com_node: link", OK)
        self.wait_for_status("odom_node: wheel feedback", OK)

    def run_tool(self, name, *arguments, **environment):
        script = places.package("robotont_operations") / "scripts" / name
        return subprocess.run(["/usr/bin/python3", script, *map(str, arguments)], check=False, text=True,
                              timeout=60, capture_output=True, env={**os.environ, **environment})


class StatusTest(StackTest):
    def test_status_from_well_to_dead(self):
        done = self.run_tool("status")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertLess(max(map(len, done.stdout.splitlines())), 102)
        head = subprocess.run(["bash", "-c", f"{places.program('robotont_operations', 'status')} | head -n 1"],
                              check=False, text=True, timeout=60, capture_output=True)
        self.assertEqual((head.stdout.count("\n"), head.stderr), (1, ""))
        for words in ("nodes", "link", "board", "command stream", "config/robots/thesis", "packets/s, checked"):
            self.assertIn(words, done.stdout)
        self.assertNotIn("\033", done.stdout)  # colours are for terminals
        self.board.unplug()
        self.wait_for_status("serial_com_node: link", 2)
        done = self.run_tool("status")
        self.assertEqual(done.returncode, 2, done.stdout)
        self.assertRegex(done.stdout, "ERROR +link")
        with suspended(self.processes.pid("/serial_com_node")):
            done = self.run_tool("status")
        self.assertIn("/serial_com_node does not answer", done.stdout)
        for uri, words in (("http://127.0.0.1:9", "no ROS master"),
                           (self.processes.uri.replace("http:", "https:"), "allowed: http://HOST:PORT")):
            done = self.run_tool("status", ROS_MASTER_URI=uri)
            self.assertEqual(done.returncode, 3)
            self.assertIn(words, done.stderr)
        self.board.plug()
        self.wait_for_status("serial_com_node: link", OK)
        pid = self.processes.pid("/serial_com_node")
        os.kill(pid, signal.SIGKILL)

        def is_back():
            with contextlib.suppress(OSError):
                return self.processes.pid("/serial_com_node") != pid
        wait_for(is_back, "serial_com_node", START)
        self.status.clear()
        self.wait_for_status("serial_com_node: link", OK)
        self.assertIn("restarts of /serial_com_node: 1", self.run_tool("status").stdout)


class NightlyReportTest(StackTest):
    """Once a day; what is in a report and what is not, test_report has."""

    def test_report(self):
        rospy.set_param("/web_teleop/token", "hunter22")
        folder = self.processes.folder / "black_box"
        self.processes.launch("recorder.launch", f"folder:={folder}")
        wait_for(lambda: folder.exists() and runs_in(folder) and len(bags_of(runs_in(folder)[0])) > 2,
                 "the black box")  # the first bags may be from before all topics were connected
        logs = self.processes.folder / "logs"
        logs.mkdir()
        (logs / "web_teleop_node-1.log").write_text("open http://robot/?token=hunter22\n")
        (logs / "driver_node-1.log").write_text("wheels turn\n")
        (folder / "run_000000_x").mkdir()
        (folder / "run_000000_x/000001.bag").write_bytes(os.urandom(5000))
        output = self.processes.folder / "out.tar.gz"
        done = self.run_tool("report", "--output", output, "--black-box", folder, ROS_LOG_DIR=str(logs))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(output.stat().st_mode & 0o777, 0o600)
        unpacked = self.processes.folder / "unpacked"
        with tarfile.open(str(output)) as archive:
            archive.extractall(str(unpacked))
        root = unpacked / "out"
        self.assertIn("wheelRads", (root / "ros/parameters.yaml").read_text())
        self.assertIn("/serial_com_node", (root / "ros/graph.yaml").read_text())
        self.assertIn("robotont_driver", (root / "versions/stack.txt").read_text())
        self.assertIn("run_000000_x/000001.bag", (root / "notes.txt").read_text())
        self.assertIn("wheels turn", (root / "logs/ros/logs/driver_node-1.log").read_text())
        with rosbag.Bag(str(max((root / "black_box").glob("*.bag")))) as bag:
            self.assertIn("/serial_read", bag.get_type_and_topic_info()[1])
        for path in root.rglob("*"):
            if path.is_file():
                self.assertNotIn(b"hunter22", path.read_bytes(), path)


if __name__ == "__main__":
    rostest.rosrun("robotont_operations", "status_test", NightlyReportTest if "nightly" in sys.argv else StatusTest)
