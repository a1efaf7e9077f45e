"""The wiring table of docs/firmware.md is the wiring of the profile; its example lines are the firmware's."""

import importlib
import re
import runpy
import sys

from firmware_tools import ROOT, SRC

TEXT = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in TEXT.splitlines()
    if re.match(r"\| [0-9] \| ", line)
]


def module(name):
    sys.path.insert(0, str(SRC))
    try:
        return importlib.import_module("robotont_firmware." + name)
    finally:
        sys.path.remove(str(SRC))


def config():
    return module("config")


def test_leads_with_which_robot_needs_what():
    """Nobody may take the wiring `ours` for Robotont's, or flash a robot that needs no flashing."""
    lead = TEXT.split("\n## ")[1]
    assert lead.startswith("Which robot do you have?")
    rows = [line for line in lead.splitlines() if line.startswith("| ")][1:]
    assert "as it was built | **Flash nothing.**" in rows[0]
    for path in sorted((SRC / "robotont_firmware").glob("wiring*.py")):
        profile = runpy.run_path(str(path))["PROFILE"]
        assert [row for row in rows if f"`./robotont flash --profile {profile}`" in row], profile
    assert "**The wiring `ours` is not Robotont's.**" in lead
    assert "Nothing is flashed" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_wiring_table():
    wiring = config()
    expected = set()
    for motor in range(wiring.WHEELS):
        pin_a, pin_b, timer, function = wiring.ENCODERS[motor]
        pwm, pwm_timer, channel, pwm_function = wiring.PWM[motor]
        forward, backward = wiring.DIRECTIONS[motor]
        expected |= {
            (str(motor), "encoder A", pin_a, f"TIM{timer} channel 1", f"AF{function}"),
            (str(motor), "encoder B", pin_b, f"TIM{timer} channel 2", f"AF{function}"),
            (str(motor), "PWM", pwm, f"TIM{pwm_timer} channel {channel}", f"AF{pwm_function}"),
            (str(motor), "forward", forward, "", ""),
            (str(motor), "backward", backward, "", ""),
            (str(motor), "fault", wiring.FAULTS[motor], "", ""),
        }
    assert {(row[0], row[1], row[2], row[4], row[5]) for row in ROWS} == expected
    pins = [row[2] for row in ROWS]
    assert len(set(pins)) == len(pins), "a pin is used twice"


def test_moved_wires():
    moved = re.findall(r"^\| M(\d) \(\d+°\) \| ([AB]) \| (\w+) \| (\w+) \|$", TEXT, flags=re.MULTILINE)
    assert len(moved) == 4
    wiring = runpy.run_path(str(SRC / "robotont_firmware" / "wiring_robotont21.py"))
    for motor, channel, _, pin in moved:
        assert wiring["ENCODERS"][int(motor)]["AB".index(channel)] == pin


def test_banner_after_flashing():
    """The chip takes MicroPython's reset for its button; test/dual/suite_board.py has the word of every cause."""
    banner = module("identity").Identity(None, config(), 3, "button").banner
    assert "`{}`".format(banner.decode().rsplit(";", 1)[0]) in TEXT


def test_watchdog_and_timeout():
    wiring = config()
    assert f"watchdog ({wiring.WATCHDOG} ms)" in TEXT
    assert 0.48 <= wiring.TIMEOUT / wiring.RATE <= 0.5  # a packet may have come one period before its tick
