"""./robotont wheels --tune as a program: the firmware behind a pseudo-terminal, a person at another one."""

import contextlib
import os
import select
import signal
import subprocess
import sys
import termios
import threading
import time
import tty

import pytest
from firmware_tools import DUAL, ROOT

from robotont_firmware import config

sys.path.append(str(DUAL))

from lifted_robot import MOST, LiftedRobot

PROGRAM = ROOT / "robotont_driver" / "scripts" / "turned_wheels"


class RobotAtAPort:
    """A LiftedRobot in real time behind a pseudo-terminal, and the program on another one."""

    def __init__(self):
        self.robot = LiftedRobot()
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        self.keyboard, self.terminal = os.openpty()
        self.before = termios.tcgetattr(self.terminal)
        self._going = True
        self.driven = []  # periods of each drive
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self.program = subprocess.Popen(
            [sys.executable, str(PROGRAM), os.ttyname(self._slave), "--tune", "robot:=thesis"], stdin=self.terminal,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip

    def _run(self):
        due, was = time.monotonic(), 0
        while self._going:
            with contextlib.suppress(BlockingIOError, OSError):
                self.robot.write(os.read(self.master, 4096))
            sent = self.robot.read(0)
            left = self.robot.controller._test_left
            if left > was:
                self.driven.append(0)
            if was > 0 or left > 0:
                self.driven[-1] += 1
            was = left
            with contextlib.suppress(BlockingIOError, OSError):
                os.write(self.master, sent)
            due += 0.02
            time.sleep(max(0.0, due - time.monotonic()))

    def wait(self, done, seconds=30):
        end = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < end, self.driven
            time.sleep(0.002)

    def begin(self):
        """Press Enter and wait for the middle of the sixth step."""
        said = b""
        while b"Press Enter" not in said:
            assert select.select([self.program.stdout], [], [], 30)[0]
            data = os.read(self.program.stdout.fileno(), 4096)
            assert data, said
            said += data
        os.write(self.keyboard, b"\n")
        self.wait(lambda: len(self.driven) >= 6 and self.driven[-1] in range(4, 12))

    def pull(self):
        """Take the cable away."""
        self.off = self.master
        self.master = os.open(os.devnull, os.O_RDWR)  # the board runs on, and hears nothing
        os.close(self.off)
        os.close(self._slave)
        self._slave = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._going = False
        self._thread.join()
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()
        self.program.stdout.close()
        for descriptor in (self.master, self._slave, self.keyboard, self.terminal):
            if descriptor is not None:
                os.close(descriptor)


@pytest.mark.timed
@pytest.mark.parametrize("cause, status, words", [
    ("key", 1, "ended by a key: the wheels are stopped"),
    (signal.SIGTERM, 143, ""),
    (signal.SIGHUP, 129, ""),
    (signal.SIGINT, 130, ""),
    ("cable", 1, "is the board still plugged in?"),
    (signal.SIGKILL, -9, ""),
])
def test_whatever_ends_it_in_mid_step_ends_the_step(cause, status, words):
    """By the program's order within some periods; without it, or without a line, by the board's clock."""
    with RobotAtAPort() as place:
        place.begin()
        if cause == "key":
            os.write(place.keyboard, b"x")
        elif cause == "cable":
            place.pull()
        else:
            place.program.send_signal(cause)
        said = place.program.communicate(timeout=20)[0].decode()
        assert place.program.returncode == status, said
        assert words in said
        assert "Traceback" not in said
        place.wait(lambda: place.robot.controller._test_left <= 0 and not any(place.robot.efforts))
        steps = len(place.driven)
        by_its_clock = cause in ("cable", signal.SIGKILL)
        assert place.driven[-1] == config.TEST_TIME if by_its_clock else place.driven[-1] < config.TEST_TIME
        ticks = place.robot.ticks
        place.wait(lambda: place.robot.ticks > ticks + 30)
        assert len(place.driven) == steps
        assert place.robot.fastest <= MOST
        if cause != signal.SIGKILL:
            assert termios.tcgetattr(place.terminal) == place.before


def test_without_a_terminal_nothing_is_driven():
    done = subprocess.run([sys.executable, str(PROGRAM), "/dev/null", "--tune"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "nothing was driven" in done.stderr


def test_a_bound_too_low_to_measure_anything_is_refused():
    done = subprocess.run([sys.executable, str(PROGRAM), "/dev/null", "--tune", "--speed", "0.1"],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert "--speed: found 0.1, allowed: 0.31 m/s or more" in done.stderr
