#!/usr/bin/env python3
"""keyboard_teleop in a terminal of its own: every key, letting go, and every way to end it."""

import contextlib
import fcntl
import os
import pty
import signal
import struct
import subprocess
import termios
import threading
import time

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool, String

from robotont_testing import places
from robotont_testing.harness import suspended, wait_for
from robotont_testing.node_test import NodeTest

PROGRAM = places.program("robotont_teleop", "keyboard_teleop")
STOP = (0.0, 0.0, 0.0)
HOLD = 2.0  # [s] that one press lasts: what stops sooner has another reason


class Terminal:
    """A terminal with keyboard_teleop as its only program."""

    def __init__(self, *arguments, program=(PROGRAM,)):
        self.shown = ""
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("4H", 24, 80, 0, 0))
        # the controlling terminal: Ctrl-C and SIGHUP come from it
        self.process = subprocess.Popen(["setsid", "--ctty", *map(str, program), *arguments], stdin=slave, stdout=slave,
                                        stderr=slave)
        os.close(slave)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        with contextlib.suppress(OSError):
            while True:
                data = os.read(self._master, 4096)
                if not data:
                    return
                self.shown += data.decode("utf-8", "replace")

    @property
    def line(self):
        """The newest whole line of what it shows."""
        lines = self.shown.split("\r")
        return lines[-2] if len(lines) > 1 else ""

    def type(self, text):
        os.write(self._master, text.encode())

    def take_whole_lines(self):
        """As a shell leaves it behind Ctrl-Z."""
        modes = termios.tcgetattr(self._master)
        modes[3] |= termios.ICANON | termios.ECHO
        termios.tcsetattr(self._master, termios.TCSANOW, modes)

    def hang_up(self):
        os.close(self._master)

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


class KeyboardTeleopTest(NodeTest):
    """One terminal for all that does not end it."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.terminal = Terminal(f"_first_hold:={HOLD}")
        cls.lonely = Terminal("__ns:=/robot1")  # with a robot that does not exist

    @classmethod
    def tearDownClass(cls):
        cls.terminal.end()
        cls.lonely.end()

    def setUp(self):
        super().setUp()
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(
            (message.linear.x, message.linear.y, message.angular.z)))
        self.ready(self.terminal)

    @staticmethod
    def ready(terminal):
        wait_for(lambda: "drives: " in terminal.line, "its line")

    def newest_is(self, twist, what):
        wait_for(lambda: self.hand and all(abs(one - other) < 1e-9 for one, other in zip(self.hand[-1], twist)), what)

    def moves(self, terminal):
        """Press a key, and wait for its command; returns the time [s]."""
        wait_for(lambda: (self.hand and self.hand[-1] != STOP) or terminal.type("w"), "motion", period=0.2)
        return time.monotonic()

    def release(self, stops):
        """By its key, as a person does: again where a busy computer has held it up, for then it may be old."""
        wait_for(lambda: not stops[-1].data or self.terminal.type("\x15"), "the release", period=0.3)

    def test_keys_drive_and_the_line_shows_it(self):
        terminal = self.terminal
        wait_for(lambda: "no odometry" in terminal.line, "words without odometry")
        odometry = Odometry()
        odometry.twist.twist.linear.y = 0.25
        publisher = self.publisher("odom", Odometry)
        wait_for(lambda: publisher.publish(odometry) or "| robot +0.00 +0.25 +0.00" in terminal.line, "odometry",
                 period=0.05)
        terminal.type("+")
        wait_for(lambda: terminal.line.startswith("0.33 1.10 | sent"), "the speed")
        terminal.type("-a\x1b[D")
        self.newest_is((0, 0.3, 1), "strafing and turning")
        wait_for(lambda: "sent +0.00 +0.30 +1.00" in terminal.line, "the command")
        wait_for(lambda: "drives: hand | robot +0.00 +0.25 +0.00\x1b[K" in terminal.line, "who drives, in 80 columns")
        self.newest_is(STOP, "the stop")

    def test_the_line_says_why_the_robot_does_not_obey(self):
        terminal, words = self.terminal, "in the way: something ahead, 0.06 m from the robot"
        publisher = self.publisher("/diagnostics", DiagnosticArray)
        guard = DiagnosticArray(status=[DiagnosticStatus(name="another: guard", level=DiagnosticStatus.WARN,
                                                         message=words)])
        wait_for(lambda: publisher.publish(guard) or terminal.type("w") or f"| {words}\x1b[K" in terminal.line,
                 "the words", period=0.05)
        terminal.type("s")
        self.newest_is(STOP, "the stop")
        wait_for(lambda: "sent +0.00" in terminal.line, "the usual line, at rest")

    def test_space_is_the_emergency_stop_and_that_of_others_lets_go_of_the_keys_too(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        terminal, person = self.terminal, self.publisher("emergency_stop", Bool, subscribers=1)
        for press, release in ((lambda: terminal.type(" "), lambda: terminal.type("wwww\x15")),
                               (lambda: person.publish(True), lambda: person.publish(False))):
            pressed = self.moves(terminal)
            press()
            self.newest_is(STOP, "the stop")
            self.assertLess(time.monotonic() - pressed, HOLD)
            wait_for(lambda: "EMERGENCY STOP" in terminal.line and stops and stops[-1].data, "words about the stop")
            seen = len(self.hand)
            wait_for(lambda again=release: ("EMERGENCY STOP" not in terminal.line and not stops[-1].data) or
                     (stops[-1].data and again()), "words about the release", period=1.0)
            wait_for(lambda end=pressed + HOLD: time.monotonic() > end, "the end of the key's time")
            self.assertFalse([one for one in self.hand[seen:] if one != STOP])

    def test_space_is_heard_while_the_terminal_takes_no_output(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        terminal = self.terminal
        terminal.type("\x13")  # Ctrl-S

        def still():
            shown = len(terminal.shown)
            time.sleep(0.3)
            return len(terminal.shown) == shown
        wait_for(still, "the end of its output")
        terminal.type(" ")
        wait_for(lambda: stops and stops[-1].data, "the stop")
        self.release(stops)
        terminal.type("\x11")  # Ctrl-Q
        wait_for(lambda: not still(), "its output")

    def test_of_keys_that_came_while_it_was_held_up_the_stop_alone_counts(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        person = self.publisher("emergency_stop", Bool, subscribers=1)

        def held_up(keys, press=False):
            with suspended(self.terminal.process.pid):
                self.terminal.type(keys)
                if press:
                    person.publish(True)
                    wait_for(lambda: stops and stops[-1].data, "somebody's press")
                time.sleep(1.0)  # longer than a busy computer holds it up
            time.sleep(0.5)  # nothing happens
        pressed = self.moves(self.terminal)
        held_up("")
        self.assertEqual(self.hand[-1], STOP, "driven on by a key that may be up")
        self.assertLess(time.monotonic() - pressed, HOLD)
        self.hand.clear()
        held_up("w")
        self.terminal.type(260 * "w")  # as a network hands on what has waited in it
        time.sleep(0.5)
        self.assertFalse([one for one in self.hand if one != STOP])
        held_up("\x15", press=True)
        self.assertTrue(stops[-1].data, "released by a key from before the press")
        self.release(stops)
        held_up("w ")
        wait_for(lambda: stops[-1].data, "the stop")
        self.release(stops)

    def test_behind_ctrl_z_and_fg_the_stop_needs_no_enter(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        with suspended(self.terminal.process.pid):
            self.terminal.take_whole_lines()
        self.terminal.type(" ")
        wait_for(lambda: stops and stops[-1].data, "the stop")
        self.release(stops)

    def test_a_key_that_means_nothing_is_told(self):
        for key in ("\u0446", "z"):  # the one in the place of w, Cyrillic and French
            wait_for(lambda key=key: "another keyboard layout" in self.terminal.line or self.terminal.type(key),
                     "words", period=0.3)
            self.terminal.type("s")
            self.newest_is((-0.3, 0.0, 0.0), "motion")
            wait_for(lambda: "sent -0.30" in self.terminal.line, "the usual line")
            self.terminal.type("w")
            self.newest_is(STOP, "the stop")

    def test_keys_that_are_typed_while_it_starts_drive_nothing_and_its_end_stops_the_robot(self):
        commands = self.listen("cmd_vel", Twist)
        ends = (("Ctrl-C", lambda terminal: terminal.type("\x03")),
                ("Esc", lambda terminal: terminal.type("\x1b")),
                ("a lost terminal", lambda terminal: terminal.hang_up()),
                ("SIGTERM", lambda terminal: os.killpg(terminal.process.pid, signal.SIGTERM)),
                ("SIGKILL, by the mux", lambda terminal: terminal.end()))
        terminals = [Terminal(f"_first_hold:={HOLD}") for _ in ends]  # they start side by side
        for terminal in terminals:
            self.addCleanup(terminal.end)
            terminal.type("w")
        self.listen("cmd_vel/hand", Twist, publishers=len(terminals) + 1)  # theirs too, before a key goes down
        for terminal in terminals:
            self.ready(terminal)
        time.sleep(0.5)  # nothing happens
        self.assertFalse([one for one in self.hand if one != STOP])
        for terminal, (what, act) in zip(terminals, ends):
            pressed = self.moves(terminal)
            wait_for(lambda: commands and commands[-1].linear.x > 0, "motion")
            act(terminal)
            wait_for(lambda: commands[-1].linear.x == 0.0, f"the stop after {what}")
            self.assertLess(time.monotonic() - pressed, HOLD, what)
            if "SIGKILL" not in what:
                self.newest_is(STOP, f"its own zero after {what}")
                terminal.process.wait(20)
                self.assertNotIn("Traceback", terminal.shown)
            self.hand.clear()

    def test_where_nobody_listens_the_line_says_what_to_do(self):
        """As behind a robot's restart: its new master does not know these keys."""
        terminal = self.lonely
        wait_for(lambda: "no cmd_vel_mux on /robot1/cmd_vel/hand: robot started anew? Esc, keys again" in terminal.line,
                 "what to do")
        self.listen("/robot1/cmd_vel/hand", Twist)
        wait_for(lambda: "| drives: ?" in terminal.line, "somebody who listens")
        terminal.type(" ")
        wait_for(lambda: "THE ROBOT HAS NOT CONFIRMED" in terminal.line, "that nobody has heard the stop")

    def test_without_a_terminal_it_says_so(self):
        result = subprocess.run([PROGRAM], stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
        self.assertEqual((result.returncode, result.stdout.count("\n")), (1, 1), result.stdout)
        self.assertIn("no terminal to read keys from", result.stdout)
        self.assertFalse(rospy.is_shutdown())


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "keyboard_teleop_test", KeyboardTeleopTest)
