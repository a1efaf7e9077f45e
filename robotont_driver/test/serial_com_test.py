"""serial_com_node between the topics and a board behind a pseudo-terminal."""

import math
import time

import rospy
from std_msgs.msg import String

from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.stand_in_board import Board

TASK = "serial_com_node: link"
BOARD = "serial_com_node: board"


class SerialComTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.read = self.listen("serial_read", String)
        self.board = Board(str(self.processes.folder / "board"), start_totals=0xFF00)
        self.addCleanup(self.board.close)
        self.log = self.processes.folder / "log"
        self.addCleanup(self.forget_parameters)

    @staticmethod
    def forget_parameters():
        """What one test gives its node would else stay on the parameter server for the next one's."""
        if rospy.has_param("serial_com_node"):
            rospy.delete_param("serial_com_node")

    def start(self, *arguments, plug=True):
        if plug:
            self.board.plug()
        self.node = self.processes.node("serial_com_node", f"_port:={self.board.link}", *arguments, log=self.log)
        if plug:
            wait_for(lambda: self.read, "packets")
        self.write = self.publisher("serial_write", String)

    def packets(self):
        return [tuple(map(int, message.data.rstrip("\n").rstrip(";").split(":"))) for message in list(self.read)]

    def heard(self):
        return [line for _, line in self.board.heard]

    def command(self, packet):
        """Send a command, each second anew until the board hears it: one that waited for a processor is too old."""
        sent = -math.inf

        def heard():
            nonlocal sent
            if time.monotonic() > sent + 1.0:
                sent = time.monotonic()
                self.write.publish(packet)
            return any(line.startswith(packet.rstrip("\n")) for line in self.heard())
        wait_for(heard, packet)
