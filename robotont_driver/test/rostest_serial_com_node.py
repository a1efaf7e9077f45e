#!/usr/bin/env python3
"""What passes serial_com_node, in both directions, and what does not; its port, its end."""

import signal
import time

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from serial_com_test import BOARD, TASK, SerialComTest
from std_msgs.msg import String

from robotont_testing.harness import suspended, wait_for
from robotont_testing.node_test import ERROR, OK
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board


def total(packets):
    """Sums per wheel."""
    return [sum(column) for column in zip(*packets)]


class SerialComNodeTest(SerialComTest):
    def test_packets_go_both_ways_and_commands_are_checked_once_the_board_is(self):
        self.start()
        self.board.restart()  # a board says who it is as it starts
        wait_for(lambda: BOARD in self.status and self.values(BOARD)["board"] == "robotont stand-in 1", "the banner")
        self.command("10.25:-3.00:0.00;\n")
        self.assertRegex(self.heard()[-1], r"^10\.25:-3\.00:0\.00;[0-9A-F]{4}$")
        wait_for(lambda: (10, -3, 0) in self.packets(), "the counts")
        self.assertTrue(all(message.data.endswith(";\n") for message in self.read))
        self.wait_for_status(TASK, OK, "packets/s")
        self.assertEqual(self.values(TASK)["packets"], "checked")

    def test_a_plain_board_gets_plain_commands(self):
        self.board.checked = False
        self.start()
        self.command("10.25:-3.00:0.00;\n")
        self.assertEqual(self.heard()[-1], "10.25:-3.00:0.00;")
        wait_for(lambda: (10, -3, 0) in self.packets(), "the counts")

    def test_diagnostics_come_as_often_as_asked_for(self):
        self.board.plug()
        self.node = self.processes.node(
            "serial_com_node", f"_port:={self.board.link}", "_diagnostic_period:=0.1", log=self.log)
        reports = []
        self.listen("/diagnostics", DiagnosticArray, lambda message: reports.append(time.monotonic()))
        wait_for(lambda: len(reports) > 20, "reports")
        intervals = sorted(after - before for before, after in zip(reports, reports[1:]))
        self.assertLess(intervals[len(intervals) // 2], 0.5)

    def test_an_echo_is_named_and_moves_nothing(self):
        self.board.line.cut = True
        self.board.on_bytes = lambda _, data: self.board.send(data)
        self.board.plug()
        self.node = self.processes.node(
            "serial_com_node", f"_port:={self.board.link}", "_packets:=plain", log=self.log)
        self.write = self.publisher("serial_write", String)
        wait_for(lambda: self.write.publish("10.25:-3.00:0.00;\n") or (
            TASK in self.status and "sends back what it gets" in self.status[TASK].message), "the words", period=0.05)
        self.assertEqual([packet for packet in self.read if packet.data != "0:0:0;\n"], [])

    def test_lines_that_are_no_packets_are_quoted(self):
        self.board.line.cut = True
        self.board.plug()
        self.node = self.processes.node(
            "serial_com_node", f"_port:={self.board.link}", "_packets:=checked", log=self.log)
        wait_for(lambda: self.board.send(b"hello, I am a printer\n") or (
            TASK in self.status and "lines came" in self.status[TASK].message
            and "hello, I am a printer" in self.status[TASK].message), "the words", period=0.05)

    def test_endless_numbers_are_refused_by_their_length(self):
        self.start()
        begun = time.monotonic()
        for number, text in enumerate(("9" * 5000 + ":0:0;\n", "9" * 200000, "1" * 1000000 + ".0:0:0;\n"), 1):
            self.write.publish(text)
            wait_for(lambda number=str(number): TASK in self.status
                     and self.values(TASK).get("commands refused") == number, "the diagnostics")
        self.assertLess(time.monotonic() - begun, 15.0)  # a number of 200 kB took 17 s, and 1 MB minutes
        self.command("7:7:7;\n")
        told = self.log.read_text()
        self.assertEqual(told.count("serial_write refused"), 1)  # three of a kind
        self.assertNotIn("Traceback", told)

    def test_a_command_that_is_no_packet_does_not_reach_the_board(self):
        self.start()
        for number, text in enumerate(("", "1:2:3:4;\n", "nan:1:2;\n", "1:2:3\n4:5:6;\n"), 1):
            self.write.publish(text)
            wait_for(lambda number=str(number): TASK in self.status
                     and self.values(TASK).get("commands refused") == number, "the diagnostics")
        self.command("7:7:7;\n")
        self.assertEqual([line for line in self.heard() if not line.startswith("0:0:0;")][0][:6], "7:7:7;")

    def test_a_missing_port_a_port_that_vanishes_and_one_that_comes_back(self):
        self.start(plug=False)
        self.wait_for_status(TASK, ERROR, "is the board plugged in")
        self.write.publish("5:5:5;\n")
        wait_for(lambda: self.values(TASK)["commands while the port was closed"] == "1", "the count of what is dropped")
        self.board.plug()
        wait_for(lambda: self.read, "packets")
        self.wait_for_status(TASK, OK)
        for _ in range(2):
            self.board.unplug()
            self.wait_for_status(TASK, ERROR)
            self.read.clear()
            self.board.plug()
            wait_for(lambda: self.read, "packets")
            self.wait_for_status(TASK, OK)
        self.assertEqual(self.values(TASK)["reconnects"], "2")
        self.assertNotIn("5:5:5;", "".join(self.heard()))
        self.assertIsNone(self.node.poll())
        log = self.log.read_text()
        warnings = [line for line in log.splitlines() if line.startswith("[WARN]") and str(self.board.link) in line]
        self.assertEqual(len(warnings), 3, log)  # once per change
        self.assertNotIn("Traceback", log)

    def test_garbage_lines_without_end_and_wrong_fields_pass_nothing_and_break_nothing(self):
        self.board.say(bytes(range(256)) * 20)
        self.start()
        self.command("9:9:9;\n")
        wait_for(lambda: (9, 9, 9) in self.packets(), "the counts")
        for data in (b"x" * 5000, b"\n1:2;\n", b"1:2:3:4;\n", b"99999:0:0;\n", b"1:2:3;00:0001:0002:0003:0000\n"):
            self.board.say(data)
        read = len(self.read)
        wait_for(lambda: len(self.read) > read + 10, "packets afterwards")
        self.assertLessEqual(set(self.packets()), {(0, 0, 0), (9, 9, 9)})
        self.assertIsNone(self.node.poll())
        self.assertNotIn("Traceback", self.log.read_text())

    def test_a_bad_line_costs_no_count(self):
        self.board.period = 0.001
        self.start()
        self.command("33.3:-21.7:5.5;\n")
        before = len(self.board.reported)
        self.board.line.corrupt = self.board.line.drop = self.board.line.double = 0.01 / 3
        wait_for(lambda: self.write.publish("33.3:-21.7:5.5;\n") or len(self.board.reported) > before + 5000,
                 "5000 packets", period=0.1)
        self.board.line.corrupt = self.board.line.drop = self.board.line.double = 0.0
        wait_for(lambda: self.board.speeds == [0.0] * 3, "the stop")
        # whatever came before the connection was reported to nobody; the standing board reports nothing new
        wait_for(lambda: total(self.packets()) == self.board.motors.counted, "the same sums on both ends")
        wait_for(lambda: TASK in self.status and int(self.values(TASK)["periods repaired"]) > 500, "the diagnostics")
        self.assertLessEqual(max(max(map(abs, packet)) for packet in self.packets()), 34)
        values = self.values(TASK)  # lines that came, and periods that stand for lost ones
        read, repaired = int(values["packets read"]), int(values["periods repaired"])
        self.assertEqual(read + repaired, int(values["packets published"]))
        self.assertLess(read, len(self.board.reported) - repaired / 2)

    def test_what_is_made_up_for_does_not_count_as_read(self):
        self.start()
        told = len(self.board.reported)
        self.board.line.cut = True
        wait_for(lambda: len(self.board.reported) > told + 100, "lost packets")
        self.board.line.cut = False

        def repaired():
            values = self.values(TASK)
            return int(values["periods repaired"]) >= 100 and values
        values = wait_for(repaired, "the repair")
        self.assertLess(float(values["packets read per second"]), 80.0)

    def test_a_robot_with_finer_encoders_makes_more_counts_in_a_period(self):
        rospy.set_param("/fine", {**SHIPPED, "encoderEdgesPerMotorRevolution": 4096})
        self.board.plug()
        self.processes.node("serial_com_node", "__ns:=/fine", f"_port:={self.board.link}", log=self.log)
        read = self.listen("/fine/serial_read", String)
        write = self.publisher("/fine/serial_write", String)
        wait_for(lambda: write.publish("6400:-3200:0;\n") or any(
            message.data == "6400:-3200:0;\n" for message in read), "the counts", period=0.05)

    def test_five_thousand_packets_at_1000_a_second_whole_and_in_order(self):
        self.board.line.cut = True  # the board keeps silent, the test speaks
        self.board.plug()
        self.node = self.processes.node("serial_com_node", f"_port:={self.board.link}", log=self.log)
        speaker = Board("nobody", start_totals=7)
        speaker.motors.counted = [0, 0, 0]

        def packet(number):
            counts = [number % 101, -(number % 67), number % 13]
            speaker.motors.counted = [old + new for old, new in zip(speaker.motors.counted, counts)]
            data = speaker.packet(counts)
            speaker.counter = (speaker.counter + 1) % 256
            return tuple(counts), data
        sent = []

        def speak(number):
            counts, data = packet(number)
            sent.append(counts)
            self.board.send(data)
        wait_for(lambda: speak(len(sent)) or self.read, "the connection", period=0.05)
        wait_for(lambda: self.packets()[-1:] == sent[-1:], "the newest packet")
        self.read.clear()
        sent.clear()
        begin = time.monotonic()
        for number in range(5000):
            speak(number)
            time.sleep(max(0.0, begin + number * 0.001 - time.monotonic()))
        wait_for(lambda: len(self.read) >= 5000, "all packets")
        self.assertEqual(self.packets(), sent)

    def test_no_commands_means_one_stop(self):
        self.start()
        self.command("10:10:10;\n")
        wait_for(lambda: self.heard()[-1].startswith("0:0:0;"), "the stop")
        heard, reported = len(self.board.heard), len(self.board.reported)
        wait_for(lambda: len(self.board.reported) > reported + 60, "more than a second")
        self.assertEqual(len(self.board.heard), heard)

    def test_a_fault_of_the_program_is_reported_and_ends_nothing(self):
        broken = self.processes.folder / "broken"
        code = (
            "import os, sys\n"
            "from robotont_driver import serial_com_node\n"
            "feed = serial_com_node.SerialComNode._on_bytes\n"
            "def fail(node, data):\n"
            f"    return [][1] if os.path.exists({str(broken)!r}) else feed(node, data)\n"
            "serial_com_node.SerialComNode._on_bytes = fail\n"
            "serial_com_node.main()\n")
        self.board.plug()
        self.processes.start(
            "python3", "-c", code, "__name:=serial_com_node", f"_port:={self.board.link}", log=self.log)
        wait_for(lambda: self.read, "packets")
        broken.touch()
        self.wait_for_status(TASK, ERROR, "a fault of serial_com_node itself, IndexError: list index out of range")
        broken.unlink()
        self.wait_for_status(TASK, OK, "packets/s")
        words = self.log.read_text()
        self.assertIn("in fail", words)  # the traceback, ...
        self.assertEqual(words.count("please report it"), 1)  # ... once

    def test_commands_that_waited_while_the_node_was_stopped_do_not_drive(self):
        self.start()
        self.command("10:10:10;\n")
        pid = self.processes.pid("/serial_com_node")
        with suspended(pid):
            end = time.monotonic() + 1.0  # longer than ~write_timeout
            while time.monotonic() < end:
                self.write.publish("20:20:20;\n")  # then its sender dies
                time.sleep(0.02)
            read = len(self.read)
        wait_for(lambda: len(self.read) > read + 25, "packets afterwards")
        self.assertNotIn("20:20:20;", "".join(self.heard()))
        wait_for(lambda: int(self.values(TASK)["times that this node was stopped or starved"]) >= 1, "the diagnostics")
        wait_for(lambda: self.write.publish("30:30:30;\n") or "30:30:30;" in "".join(self.heard()), "a new command",
                 period=0.05)

    def test_the_last_packet_is_a_stop_however_the_node_ends(self):
        self.board.plug()
        for how in (signal.SIGINT, signal.SIGTERM):
            self.read.clear()
            self.start(plug=False)
            wait_for(lambda: self.read, "packets")
            wait_for(lambda: self.write.publish("10:10:10;\n") or any(
                line.startswith("10:10:10;") for line in self.heard()), "the command", period=0.05)
            self.processes.stop(self.node, how)
            wait_for(lambda: self.heard()[-1].startswith("0:0:0;"), "the stop")
            self.board.heard.clear()


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "serial_com_node_test", SerialComNodeTest)
