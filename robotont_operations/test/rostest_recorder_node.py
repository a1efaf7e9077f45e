#!/usr/bin/env python3
"""recorder_node beside a stream of messages: ended by force, and by Ctrl-C."""

import signal
import time

import rosbag
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_operations.black_box_files import bags_of, runs_in
from robotont_testing import places
from robotont_testing.node_test import NodeTest, twist


class RecorderNodeTest(NodeTest):
    def record(self, space, amount, how):
        """Let a recorder in a namespace hear so many packets and end it; (their numbers, bags, [s] of each, status)."""
        folder = self.processes.folder / space
        recorder = self.processes.start(places.program("robotont_operations", "recorder_node"), f"_folder:={folder}",
                                        f"__ns:=/{space}")
        read, odom, command = (self.publisher(f"/{space}/{name}", kind) for name, kind in (
            ("serial_read", String), ("odom", Odometry), ("cmd_vel", Twist)))
        sent = []
        while len(sent) < amount:
            read.publish(f"{len(sent)}:0:0;\n")
            odom.publish(Odometry())
            command.publish(twist(0.1))
            sent.append(time.time())
            time.sleep(0.02)
        time.sleep(0.1)  # the newest are on their way
        status = self.processes.stop(recorder, how)
        bags, found = bags_of(runs_in(folder)[-1]), []
        for path in bags:
            with rosbag.Bag(str(path)) as bag:
                found += [int(message.data.split(":")[0])
                          for _, message, _ in bag.read_messages(f"/{space}/serial_read")]
        self.assertEqual(found, list(range(found[0], found[-1] + 1)))  # none missing in between
        return found, bags, sent, status

    def test_killed_by_force_all_but_the_last_second_opens_with_stock_rosbag(self):
        packets, _, sent, _ = self.record("killed", 110, signal.SIGKILL)  # more than two periods
        self.assertLess(packets[0], 5)
        self.assertGreater(sent[packets[-1]], sent[-1] - 1.1)  # a period, and the time that writing takes

    def test_at_ctrl_c_the_last_message_is_recorded(self):
        packets, bags, sent, status = self.record("ended", 10, signal.SIGINT)
        self.assertEqual((status, packets[-1]), (0, len(sent) - 1))
        self.assertFalse(list(bags[0].parent.glob("*.writing")))


if __name__ == "__main__":
    rostest.rosrun("robotont_operations", "recorder_node_test", RecorderNodeTest)
