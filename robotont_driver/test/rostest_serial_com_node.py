#!/usr/bin/env python3
"""What passes serial_com_node, in both directions, and what does not; its port, its end; what it says of the board."""

import math
import re
import time

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN, NodeTest
from robotont_testing.stand_in_board import Board, identity

TASK = "serial_com_node: link"
BOARD = "serial_com_node: board"


class SerialComNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.read = self.listen("serial_read", String)
        self.board = Board(str(self.processes.folder / "board"), start_totals=0xFF00)
        self.addCleanup(self.board.close)
        self.log = self.processes.folder / "log"

    def start(self, *arguments, plug=True):
        # what one test gives its node would else stay on the parameter server for the next one's
        if rospy.has_param("serial_com_node"):
            rospy.delete_param("serial_com_node")
        if plug:
            self.board.plug()
        self.node = self.processes.node("serial_com_node", f"_port:={self.board.link}", *arguments, log=self.log)
        if plug and not self.board.line.cut:
            wait_for(lambda: self.read, "packets")
        self.write = self.publisher("serial_write", String)

    def packets(self):
        return [tuple(map(int, message.data.partition(";")[0].split(":"))) for message in list(self.read)]

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

    def test_both_ways_refusals_silence_and_bad_lines(self):
        self.start("_diagnostic_period:=0.2")
        reports = []
        self.listen("/diagnostics", DiagnosticArray, lambda message: reports.append(time.monotonic()))
        self.board.restart()  # a board says who it is as it starts
        wait_for(lambda: BOARD in self.status and self.values(BOARD)["board"] == "robotont stand-in 1", "the banner")
        self.command("10.25:-3.00:0.00;\n")
        self.assertRegex(self.heard()[-1], r"^10\.25:-3\.00:0\.00;[0-9A-F]{4}$")
        wait_for(lambda: (10, -3, 0) in self.packets(), "the counts")
        told = [re.fullmatch(r"[0-9:-]+;[0-9]+(?:\n|;([0-9.:-]+);\n)", message.data) for message in list(self.read)]
        self.assertTrue(all(told))
        self.assertIn("10.25:-3.00:0.00", [match.group(1) for match in told])
        self.wait_for_status(TASK, OK, "packets/s")
        self.assertEqual(self.values(TASK)["packets"], "checked")
        heard = len(self.heard())
        begun = time.monotonic()
        for number, text in enumerate(("", "nan:1:2;\n", "1:2:3\n4:5:6;\n", "1" * 1000000 + ".0:0:0;\n"), 1):
            self.write.publish(text)
            wait_for(lambda number=str(number): self.values(TASK)["commands refused"] == number, "the diagnostics")
        self.assertLess(time.monotonic() - begun, 15.0)  # a number of 1 MB took minutes
        self.assertEqual({line[:6] for line in self.heard()[heard:]} - {"0:0:0;", "10.25:"}, set())
        self.board.line.cut = True
        told = len(self.board.reported)
        wait_for(lambda: len(self.board.reported) > told + 60, "lost packets")
        self.board.line.cut = False  # before the counter of the packets has gone round
        values = wait_for(lambda: int(self.values(TASK)["periods repaired"]) >= 50 and self.values(TASK), "the repair")
        self.assertLess(float(values["packets read per second"]), 80.0)  # what is made up for has not been read
        read, repaired = int(values["packets read"]), int(values["periods repaired"])
        self.assertEqual(read + repaired, int(values["packets published"]))
        self.board.line.cut = True
        self.wait_for_status(TASK, WARN, "no packets")
        self.board.line.cut = False
        self.board.line.corrupt = 0.02
        self.wait_for_status(TASK, WARN, "of the board's lines are lost")
        self.board.line.corrupt = 0.0005  # a line in 40
        self.wait_for_status(TASK, WARN, "dropped since the last report")
        self.board.line.corrupt = 0.0
        self.wait_for_status(TASK, OK)
        intervals = sorted(after - before for before, after in zip(reports, reports[1:]))
        self.assertLess(intervals[len(intervals) // 2], 0.6)
        self.assertNotIn("Traceback", self.log.read_text())

    def test_a_missing_port_a_port_that_vanishes_and_one_that_comes_back(self):
        self.start(plug=False)
        self.wait_for_status(TASK, ERROR, "is the board plugged in")
        dropped = "commands while the port was closed"  # again and again: one that waited for a processor is too old
        wait_for(lambda: self.write.publish("5:5:5;\n") or self.values(TASK)[dropped] != "0", dropped, period=0.2)

        def all_have_come():  # one that is under way as the port opens would drive, rightly
            before, told = self.status[TASK], self.values(TASK)[dropped]
            wait_for(lambda: self.status[TASK] is not before, "a report")
            return self.values(TASK)[dropped] == told
        wait_for(all_have_come, "the end of them")
        self.board.plug()
        self.wait_for_status(TASK, OK)
        self.board.unplug()
        self.wait_for_status(TASK, ERROR)
        self.read.clear()
        self.board.plug()
        wait_for(lambda: self.read, "packets")
        self.wait_for_status(TASK, OK)
        self.assertEqual(self.values(TASK)["reconnects"], "1")
        self.assertNotIn("5:5:5;", "".join(self.heard()))
        log = self.log.read_text()
        warnings = [line for line in log.splitlines() if line.startswith("[WARN]") and str(self.board.link) in line]
        self.assertEqual(len(warnings), 2, log)  # once per change
        self.assertNotIn("Traceback", log)

    def wait_for_words(self, level, words):
        """In the diagnostics within 1.5 s."""
        began = time.monotonic()
        self.wait_for_status(BOARD, level, words)
        self.assertLess(time.monotonic() - began, 1.5)

    def test_a_board_of_today_is_asked_who_it_is_and_its_faults_are_told(self):
        self.board.banner, self.board.identity = None, identity()
        self.board.answer = lambda: None
        self.board.restart()
        self.start()
        timer = rospy.Timer(rospy.Duration(0.05), lambda _: self.write.publish("5:5:5;\n"))
        self.addCleanup(timer.shutdown)
        self.wait_for_status(BOARD, WARN, "not identified itself yet")
        self.assertNotIn("5:5:5;", "".join(self.heard()))
        self.board.faults = [0, 3, 0]
        self.wait_for_words(ERROR, "wheel 1: counts against its direction")
        self.board.faults = [0, 0, 0]
        del self.board.answer
        wait_for(lambda: "5:5:5;" in "".join(self.heard()), "commands")
        self.wait_for_words(OK, "no fault")
        self.assertEqual(self.values(BOARD)["board profile"], "ours")
        self.board.unplug()
        self.board.identity = identity(reset="watchdog")
        self.board.faults = [0, 0, 2]
        self.wait_for_status(TASK, ERROR)
        self.board.plug()
        wait_for(lambda: self.values(BOARD).get("board reset") == "watchdog", "the new answer")
        self.wait_for_words(ERROR, "wheel 2: no counts")
        self.board.restart(start_totals=0x1234)
        wait_for(lambda: self.values(TASK)["board restarts"] == "1", "the diagnostics")
        wait_for(lambda: "restarted" in self.log.read_text(), "words in the log")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "serial_com_node_test", SerialComNodeTest)
