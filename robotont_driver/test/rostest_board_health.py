#!/usr/bin/env python3
"""What the diagnostics report about the board: silence, words, faults, identity, restarts."""

import time

import rospy
import rostest
from serial_com_test import BOARD, TASK, SerialComTest

from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN
from robotont_testing.stand_in_board import Board, identity


class BoardHealthTest(SerialComTest):
    def test_a_silent_board_and_a_wrong_line_are_reported(self):
        self.start()
        self.board.line.cut = True
        self.wait_for_status(TASK, WARN, "no packets")
        self.board.line.cut = False
        self.board.line.corrupt = 0.02
        self.wait_for_status(TASK, WARN, "dropped in the last second")
        self.board.line.corrupt = 0.0
        self.wait_for_status(TASK, OK)

    def test_every_word_of_an_old_board_is_reported(self):
        self.start()
        self.board.say(b"# fault motor 1\n")
        self.wait_for_status(BOARD, ERROR, "fault motor 1")
        self.board.say(b"# fault cleared\n")
        self.wait_for_status(BOARD, OK)
        for words in ("timeout: no valid packet, motors stop", "dropped 17", "crash ValueError()"):
            self.board.say(f"# {words}\n".encode())
            self.wait_for_status(BOARD, WARN, words)
            self.assertIn(words, self.values(BOARD)["board's newest messages"])

    def start_modern(self, **about):
        """A board with firmware 2.0, commanded at 20 Hz until the test ends."""
        self.board.banner = None
        self.board.identity = identity(**about)
        self.board.restart()
        self.start()
        timer = rospy.Timer(rospy.Duration(0.05), lambda _: self.write.publish("5:5:5;\n"))
        self.addCleanup(timer.shutdown)

    def time_until(self, level, words):
        """[s] until the diagnostics say so."""
        began = time.monotonic()
        self.wait_for_status(BOARD, level, words)
        duration = time.monotonic() - began
        print(f"{words!r} in the diagnostics after {duration:.2f} s")
        return duration

    def test_a_fault_from_before_the_connection_is_reported_and_its_end_too(self):
        self.board.faults = [0, 3, 0]
        self.start_modern()
        self.assertLess(self.time_until(ERROR, "wheel 1: counts against its direction"), 1.5)
        self.board.faults = [0, 0, 0]
        self.assertLess(self.time_until(OK, "no fault"), 1.5)
        self.board.unplug()
        self.board.faults = [0, 0, 2]
        self.wait_for_status(TASK, ERROR)
        self.board.plug()
        wait_for(lambda: self.board.heard, "the connection")
        self.assertLess(self.time_until(ERROR, "wheel 2: no counts"), 1.5 + 0.6)  # and the pause between attempts
        self.board.line.corrupt = 0.01  # of the bytes: two packets in five are lost
        self.board.faults = [0, 0, 0]
        self.assertLess(self.time_until(OK, "no fault"), 1.5)
        self.board.faults = [0, 2, 0]
        self.assertLess(self.time_until(ERROR, "wheel 1: no counts"), 1.5)

    def test_a_fault_that_comes_and_goes_between_two_reports_is_reported(self):
        self.start_modern()
        self.wait_for_status(BOARD, OK)
        self.board.faults = [1, 0, 0]
        heard = len(self.read)
        wait_for(lambda: len(self.read) > heard + 5, "packets")
        self.board.faults = [0, 0, 0]
        self.wait_for_status(BOARD, ERROR, "wheel 0: its motor driver")

    def test_the_board_is_asked_who_it_is_at_every_connection_and_not_driven_before(self):
        self.board.answer = lambda: None
        self.start_modern()
        self.wait_for_status(BOARD, WARN, "not identified itself yet")
        self.assertNotIn("5:5:5;", "".join(self.heard()))
        del self.board.answer
        wait_for(lambda: "5:5:5;" in "".join(self.heard()), "commands")
        self.wait_for_status(BOARD, OK)
        self.assertEqual(self.values(BOARD)["board profile"], "ours")
        self.board.unplug()
        self.board.identity = identity(reset="watchdog")
        self.board.plug()
        wait_for(lambda: self.values(BOARD).get("board reset") == "watchdog", "the new answer")

    def test_a_board_at_another_rate_or_with_other_wheels_is_not_driven(self):
        self.start_modern(rate=100)
        self.wait_for_status(BOARD, ERROR, "the board controls at 100 Hz, pidControlFrequency is 50")
        self.assertNotIn("5:5:5;", "".join(self.heard()))
        self.board.close()
        self.board = Board(self.board.link, wheels=4, banner=None, identity=identity(wheels=4))
        self.addCleanup(self.board.close)
        self.board.plug()
        self.wait_for_status(BOARD, ERROR, "the board drives 4 wheels, wheelAmount is 3")
        self.assertNotIn("5:5:5;", "".join(self.heard()))

    def test_a_board_that_restarts_is_taken_afresh(self):
        self.start()
        wait_for(lambda: self.write.publish("20:20:20;\n") or self.packets().count((20, 20, 20)) > 5, "counts",
                 period=0.05)
        self.board.restart(start_totals=0x1234)
        self.read.clear()
        wait_for(lambda: len(self.read) > 10, "packets")
        self.assertLessEqual(set(self.packets()), {(0, 0, 0), (20, 20, 20)})
        wait_for(lambda: TASK in self.status and self.values(TASK)["board restarts"] == "1", "the diagnostics")
        self.assertEqual(self.values(TASK)["periods repaired"], "0")
        wait_for(lambda: "restarted" in self.log.read_text(), "words in the log")


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "board_health_test", BoardHealthTest)
