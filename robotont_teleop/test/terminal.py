"""A terminal for tests, of which a program is the only one."""

import contextlib
import fcntl
import os
import pty
import signal
import struct
import subprocess
import termios
import threading

from robotont_testing import places

KEYBOARD_TELEOP = places.program("robotont_teleop", "keyboard_teleop")


class Terminal:
    """shown: all that the program has written."""

    def __init__(self, *arguments, program=(KEYBOARD_TELEOP,)):
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
            for data in iter(lambda: os.read(self._master, 4096), b""):
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
