#!/usr/bin/env python3
"""keyboard_teleop in a terminal of its own: what terminals do, and every way to end it."""

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
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from robotont_testing import places
from robotont_testing.harness import suspended, wait_for
from robotont_testing.node_test import NodeTest

PROGRAM = places.program("robotont_teleop", "keyboard_teleop")
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
    def setUp(self):
        super().setUp()
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(message.linear.x))
        self.stops = self.listen("emergency_stop/pressed_by", String, publishers=1)

    @staticmethod
    def ready(terminal):
        wait_for(lambda: "drives: " in terminal.line, "its line")

    def moves(self, terminal):
        """Press a key, and wait for its command; returns the time [s]."""
        wait_for(lambda: (self.hand and self.hand[-1]) or terminal.type("w"), "motion", period=0.2)
        return time.monotonic()

    def stops_by_space(self, terminal):
        """And is released by its key, as a person does: again where a busy computer has held it up."""
        terminal.type(" ")
        wait_for(lambda: self.stops and self.stops[-1].data, "the stop")
        wait_for(lambda: not self.stops[-1].data or terminal.type("\x15"), "the release", period=0.3)

    def test_space_is_heard_while_the_terminal_takes_no_output_and_behind_ctrl_z_and_fg_without_enter(self):
        terminal = Terminal()
        self.addCleanup(terminal.end)
        self.ready(terminal)
        terminal.type("\x13")  # Ctrl-S

        def still():
            shown = len(terminal.shown)
            time.sleep(0.3)
            return len(terminal.shown) == shown
        wait_for(still, "the end of its output")
        self.stops_by_space(terminal)
        terminal.type("\x11")  # Ctrl-Q
        wait_for(lambda: not still(), "its output")
        with suspended(terminal.process.pid):
            terminal.take_whole_lines()
        self.stops_by_space(terminal)

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
        self.listen("cmd_vel/hand", Twist, publishers=len(terminals))  # theirs too, before a key goes down
        for terminal in terminals:
            self.ready(terminal)
        time.sleep(0.5)  # nothing happens
        self.assertFalse(any(self.hand))
        for terminal, (what, act) in zip(terminals, ends):
            pressed = self.moves(terminal)
            wait_for(lambda: commands and commands[-1].linear.x > 0, "motion")
            act(terminal)
            wait_for(lambda: commands[-1].linear.x == 0.0, f"the stop after {what}")
            self.assertLess(time.monotonic() - pressed, HOLD, what)
            if "SIGKILL" not in what:
                wait_for(lambda: self.hand[-1] == 0.0, f"its own zero after {what}")
                terminal.process.wait(20)
                self.assertNotIn("Traceback", terminal.shown)
            self.hand.clear()

    def test_without_a_terminal_it_says_so(self):
        result = subprocess.run([PROGRAM], stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
        self.assertEqual((result.returncode, result.stdout.count("\n")), (1, 1), result.stdout)
        self.assertIn("no terminal to read keys from", result.stdout)
        self.assertFalse(rospy.is_shutdown())


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "keyboard_teleop_test", KeyboardTeleopTest)
