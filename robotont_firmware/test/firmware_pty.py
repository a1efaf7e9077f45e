"""The firmware running under MicroPython behind a pseudo-terminal."""

import contextlib
import os
import pty
import subprocess
import tty

from firmware_tools import DUAL, SRC, tool


class Firmware:
    """Runs test/dual/pty_loop.py for `periods` ticks from `start` on; `port` is the serial port to open.

    wrong: what is wrong with each motor, such as ",backward,half".
    """

    def __init__(self, periods, wheels=3, wrong=""):
        self._master, self._slave = pty.openpty()  # both stay open here, so that the line never hangs up
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        self._arguments = [str(SRC), str(self._master), str(periods), str(wheels), wrong]
        self.process = None

    def start(self):
        """Switch the board on; return self."""
        self.process = subprocess.Popen(
            [tool("micropython"), str(DUAL / "pty_loop.py"), *self._arguments],
            pass_fds=[self._master], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            preexec_fn=real_time,  # noqa: PLW1509
        )  # fmt: skip
        return self

    def finish(self):
        """Wait for the end, which is right."""
        output, _ = self.process.communicate(timeout=120)
        assert self.process.returncode == 0, output

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process is not None:
            if self.process.poll() is None:
                self.process.kill()
            self.process.wait()
            self.process.stdout.close()
        os.close(self._slave)
        os.close(self._master)


def real_time():
    """Give the process precedence where that is allowed: the board has its processor to itself, too."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
