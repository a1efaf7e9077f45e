#!/usr/bin/env python3
"""keyboard_teleop in a terminal of its own: every key, letting go, and every way to end it."""

import contextlib
import os
import pty
import signal
import subprocess
import threading
import time

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool, String

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

STOP = (0.0, 0.0, 0.0)
HOLD = 2.0  # [s] that one press lasts: what stops sooner has another reason
KEYS = {"w": (0.3, 0, 0), "s": (-0.3, 0, 0), "a": (0, 0.3, 0), "d": (0, -0.3, 0), "q": (0, 0, 1), "e": (0, 0, -1),
        "\x1b[A": (0.3, 0, 0), "\x1b[B": (-0.3, 0, 0), "\x1b[C": (0, 0, -1), "\x1b[D": (0, 0, 1)}


class Terminal:
    """A terminal with keyboard_teleop as its only program."""

    def __init__(self, *arguments):
        self.shown = ""
        self._master, slave = pty.openpty()
        # rosrun is a shell script, and so makes this the controlling terminal, from which Ctrl-C and SIGHUP come
        self.process = subprocess.Popen(["rosrun", "robotont_teleop", "keyboard_teleop", *arguments], stdin=slave,
                                        stdout=slave, stderr=slave, start_new_session=True)
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

    def hang_up(self):
        """As closing the terminal's window does."""
        os.close(self._master)

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


class KeyboardTeleopTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(
            (message.linear.x, message.linear.y, message.angular.z)))

    def start(self, *arguments):
        terminal, = self.start_many(1, *arguments)
        return terminal

    def start_many(self, number, *arguments):
        """Terminals that start side by side."""
        terminals = [Terminal(*arguments) for _ in range(number)]
        for terminal in terminals:
            self.addCleanup(terminal.end)
        for terminal in terminals:
            wait_for(lambda terminal=terminal: "listen to /cmd_vel/hand" in terminal.line,
                     "the line of keyboard_teleop")
        return terminals

    def newest_is(self, twist, what):
        wait_for(lambda: self.hand and all(abs(one - other) < 1e-9 for one, other in zip(self.hand[-1], twist)), what)

    def moves(self, terminal, key="w"):
        """Press a key, and wait for its command; returns the time [s] of the press."""
        pressed = time.monotonic()
        terminal.type(key)
        wait_for(lambda: self.hand and self.hand[-1] != STOP, "motion")
        return pressed

    def test_every_key_drives_and_letting_go_stops(self):
        terminal = self.start("_first_hold:=0.4")
        for key, twist in KEYS.items():
            terminal.type(key)
            self.newest_is(twist, repr(key))
            self.newest_is(STOP, f"the stop after {key!r}")
        terminal.type("aq")
        self.newest_is((0, 0.3, 1), "strafing and turning")
        self.newest_is(STOP, "the stop")
        terminal.type("wa")
        self.newest_is((0.3 / 2 ** 0.5, 0.3 / 2 ** 0.5, 0), "a diagonal that is no faster")
        self.newest_is(STOP, "the stop")
        for key, words in (("+", "speed 0.33 m/s 1.10"), ("-", "speed 0.30 m/s 1.00"), ("r", "speed 0.33 m/s 1.00"),
                           ("f", "speed 0.30 m/s 1.00"), ("t", "speed 0.30 m/s 1.10"), ("g", "speed 0.30 m/s 1.00")):
            terminal.type(key)
            wait_for(lambda words=words: words in terminal.line, words)

    def test_it_shows_who_listens_what_is_sent_and_what_the_robot_does(self):
        terminal = self.start()
        wait_for(lambda: "no odometry" in terminal.line, "words without odometry")
        odometry = Odometry()
        odometry.twist.twist.linear.y = 0.25
        publisher = self.publisher("odom", Odometry)
        wait_for(lambda: publisher.publish(odometry) or "robot +0.00 +0.25 +0.00" in terminal.line, "odometry",
                 period=0.05)
        terminal.type("d")
        wait_for(lambda: "sent +0.00 -0.30 +0.00" in terminal.line, "the command")
        wait_for(lambda: "drives: hand" in terminal.line, "who drives")

    def test_space_is_the_emergency_stop(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        terminal = self.start()
        self.moves(terminal)
        terminal.type(" ")
        wait_for(lambda: "EMERGENCY STOP" in terminal.line, "words about the stop")
        self.newest_is(STOP, "the stop")
        seen = len(self.hand)
        terminal.type("wwww")
        wait_for(lambda: stops and stops[-1].data, "the emergency stop")
        terminal.type("U")
        wait_for(lambda: not stops[-1].data, "the release")
        self.assertEqual(set(self.hand[seen:]), set())
        wait_for(lambda: "EMERGENCY STOP" not in terminal.line, "words about the release")
        self.moves(terminal)

    def test_a_stop_by_somebody_else_lets_go_of_the_keys(self):
        terminal = self.start(f"_first_hold:={HOLD}")
        person = self.publisher("emergency_stop", Bool, subscribers=1)
        pressed = self.moves(terminal)
        person.publish(True)
        wait_for(lambda: "EMERGENCY STOP" in terminal.line, "words about the stop")
        person.publish(False)
        wait_for(lambda: "EMERGENCY STOP" not in terminal.line, "words about the release")
        self.assertLess(time.monotonic() - pressed, HOLD)
        self.assertEqual(self.hand[-1], STOP)
        seen = len(self.hand)
        wait_for(lambda: time.monotonic() > pressed + HOLD, "the end of the key's time")
        self.assertFalse([one for one in self.hand[seen:] if one != STOP])

    def test_its_end_stops_the_robot(self):
        ends = (("Ctrl-C", lambda terminal: terminal.type("\x03")),
                ("Esc", lambda terminal: terminal.type("\x1b")),
                ("a lost terminal", lambda terminal: terminal.hang_up()),
                ("SIGHUP", lambda terminal: os.killpg(terminal.process.pid, signal.SIGHUP)),
                ("SIGTERM", lambda terminal: os.killpg(terminal.process.pid, signal.SIGTERM)))
        terminals = self.start_many(len(ends), f"_first_hold:={HOLD}")
        for terminal, (what, act) in zip(terminals, ends):
            pressed = self.moves(terminal)
            act(terminal)
            self.newest_is(STOP, f"the stop after {what}")
            self.assertLess(time.monotonic() - pressed, HOLD, what)
        for terminal in terminals:
            terminal.process.wait(20)
            self.assertNotIn("Traceback", terminal.shown)

    def test_killed_it_is_stopped_by_the_mux(self):
        commands = self.listen("cmd_vel", Twist)
        terminal = self.start(f"_first_hold:={HOLD}")
        pressed = self.moves(terminal)
        wait_for(lambda: commands and commands[-1].linear.x > 0, "motion")
        terminal.end()
        wait_for(lambda: commands[-1].linear.x == 0.0, "the stop")
        self.assertLess(time.monotonic() - pressed, HOLD)

    def test_without_a_terminal_it_says_so(self):
        result = subprocess.run([places.program("robotont_teleop", "keyboard_teleop")], stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
        self.assertEqual((result.returncode, result.stdout.count("\n")), (1, 1), result.stdout)
        self.assertIn("no terminal to read keys from", result.stdout)
        self.assertFalse(rospy.is_shutdown())


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "keyboard_teleop_test", KeyboardTeleopTest)
