"""./robotont wheels --tune as a program: the firmware behind a pseudo-terminal, a person at another one."""

import os
import select
import signal
import subprocess
import sys
import termios

import pytest
from firmware_tools import ROOT
from lifted_robot import MOST, RobotAtAPort

from robotont_firmware import config
from robotont_testing.harness import wait_for

PROGRAM = ROOT / "robotont_driver" / "scripts" / "turned_wheels"


class Tuning:
    """The program on a terminal, and a robot at a port."""

    def __init__(self):
        self.place = RobotAtAPort()
        self.robot, self.driven = self.place.robot, self.place.driven
        self.keyboard, self.terminal = os.openpty()
        self.before = termios.tcgetattr(self.terminal)
        self.program = subprocess.Popen(
            [sys.executable, str(PROGRAM), self.place.port, "--tune", "robot:=thesis"], stdin=self.terminal,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip

    def wait(self, done):
        wait_for(done, f"what was awaited, after {self.driven}", timeout=30, period=0.002)

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

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait()
        self.program.stdout.close()
        self.place.close()
        os.close(self.keyboard)
        os.close(self.terminal)


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
    with Tuning() as place:
        place.begin()
        if cause == "key":
            os.write(place.keyboard, b"x")
        elif cause == "cable":
            place.place.pull()
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


@pytest.mark.parametrize("arguments, status, words", [
    (["--bring-up"], 1, "nothing was driven"),  # without a terminal
    (["--tune"], 1, "nothing was driven"),
    (["--tune", "--speed", "0.1"], 2, "--speed: found 0.1, allowed: 0.31 m/s or more"),
])
def test_what_cannot_be_done_is_refused_and_nothing_driven(arguments, status, words):
    done = subprocess.run([sys.executable, str(PROGRAM), "/dev/null", "--robot", "thesis", *arguments],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == status
    assert words in done.stderr
