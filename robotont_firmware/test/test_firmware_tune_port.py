"""./robotont wheels --tune as a program: the firmware behind a pseudo-terminal, a person at another one."""

import os
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


@pytest.fixture
def place(tmp_path):
    """A robot at a port, and the program on a terminal of its own, in the middle of the sixth step."""
    with RobotAtAPort(tmp_path / "port") as place:
        place.keyboard, place.terminal = os.openpty()
        place.before = termios.tcgetattr(place.terminal)
        place.program = subprocess.Popen(
            [sys.executable, str(PROGRAM), place.link, "--tune", "robot:=thesis"], stdin=place.terminal,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)  # fmt: skip
        try:
            said = b""
            while b"Press Enter" not in said:
                data = os.read(place.program.stdout.fileno(), 4096)
                assert data, said
                said += data
            os.write(place.keyboard, b"\n")
            wait_for(lambda: len(place.driven) >= 6 and place.driven[-1] in range(4, 12), "a step", 30, 0.002)
            yield place
        finally:
            place.program.kill()
            place.program.communicate()
            os.close(place.keyboard)
            os.close(place.terminal)


@pytest.mark.timed
@pytest.mark.parametrize("cause, status, words", [
    ("key", 1, "ended by a key: the wheels are stopped"),
    (signal.SIGTERM, 143, ""),
    (signal.SIGHUP, 129, ""),
    (signal.SIGINT, 130, ""),
    ("cable", 1, "is the board still plugged in?"),
    (signal.SIGKILL, -9, ""),
])
def test_whatever_ends_it_in_mid_step_ends_the_step(place, cause, status, words):
    """By the program's order within some periods; without it, or without a line, by the board's clock."""
    if cause == "key":
        os.write(place.keyboard, b"x")
    elif cause == "cable":
        place.unplug()
    else:
        place.program.send_signal(cause)
    said = place.program.communicate(timeout=20)[0].decode()
    assert place.program.returncode == status, said
    assert words in said
    assert "Traceback" not in said
    wait_for(lambda: place.robot.controller._test_left <= 0 and not any(place.robot.efforts), "the step's end")
    steps, ticks = len(place.driven), place.robot.ticks
    by_its_clock = cause in ("cable", signal.SIGKILL)
    assert place.driven[-1] == config.TEST_TIME if by_its_clock else place.driven[-1] < config.TEST_TIME
    wait_for(lambda: place.robot.ticks > ticks + 30, "30 periods")
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
