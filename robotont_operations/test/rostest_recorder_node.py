#!/usr/bin/env python3
"""recorder_node beside a stream of messages: ended by force, and by Ctrl-C."""

import os
import signal
import subprocess
import threading
import time

import rosbag
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_operations.black_box_files import bags_of, runs_in
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest, twist


class RecorderNodeTest(NodeTest):
    def record(self):
        """Start the recorder and a stream of messages."""
        self.folder = self.processes.folder / "black_box"
        self.log = self.processes.folder / "recorder.log"
        topics = (("serial_read", String), ("odom", Odometry), ("cmd_vel", Twist))
        self.read, self.odom, self.command = (self.publisher(*topic, subscribers=0) for topic in topics)
        for publisher in (self.read, self.odom, self.command):  # which may count the recorder of the test before
            wait_for(lambda publisher=publisher: publisher.publish() or not publisher.get_num_connections(), "its end")
        self.recorder = self.processes.start(
            places.program("robotont_operations", "recorder_node"), f"_folder:={self.folder}", log=self.log)
        for topic in topics:
            self.publisher(*topic)
        self.sent = []
        self.streaming = True
        stream = threading.Thread(target=self._stream)
        stream.start()

        def end():
            self.streaming = False
            stream.join()
        self.addCleanup(end)

    def _stream(self):
        while self.streaming:
            self.read.publish(f"{len(self.sent)}:0:0;\n")
            self.odom.publish(Odometry())
            self.command.publish(twist(0.1))
            self.sent.append(time.time())
            time.sleep(0.02)

    def packets(self):
        """Numbers of the packets in all bags of the newest run."""
        found = []
        for path in bags_of(runs_in(self.folder)[-1]):
            with rosbag.Bag(str(path)) as bag:
                found += [int(message.data.split(":")[0]) for _, message, _ in bag.read_messages("/serial_read")]
        return found

    def test_killed_by_force_all_but_the_last_second_opens_with_stock_rosbag(self):
        self.record()
        wait_for(lambda: len(self.sent) > 110, "a stream of more than two periods")
        os.killpg(self.recorder.pid, signal.SIGKILL)
        killed = time.time()
        self.recorder.wait()
        run = runs_in(self.folder)[-1]
        info = subprocess.run(["rosbag", "info", *map(str, bags_of(run))], check=True, capture_output=True, text=True)
        for topic in ("/serial_read", "/odom", "/cmd_vel", "/diagnostics"):
            self.assertIn(topic, info.stdout)
        self.assertNotIn("unindexed", info.stdout + info.stderr)
        packets = self.packets()
        self.assertEqual(packets, list(range(packets[0], packets[-1] + 1)))  # none missing in between
        self.assertLess(packets[0], 5)
        self.assertGreater(self.sent[packets[-1]], killed - 1.2)  # a period, and the time that writing takes

    def test_at_ctrl_c_the_last_message_is_recorded(self):
        self.record()
        wait_for(lambda: len(self.sent) > 10, "a stream")
        self.streaming = False
        wait_for(lambda: self.sent[-1] < time.time() - 0.1, "the end of the stream")
        self.assertEqual(self.processes.stop(self.recorder), 0)
        packets = self.packets()
        self.assertEqual(packets, list(range(packets[0], len(self.sent))))
        self.assertFalse([path for path in self.folder.rglob("*") if path.name.endswith(".writing")])


if __name__ == "__main__":
    rostest.rosrun("robotont_operations", "recorder_node_test", RecorderNodeTest)
