"""The wiring table of docs/firmware.md is the wiring of the profile; its example lines are the firmware's."""

import re
import runpy

from firmware_tools import ROOT, SRC

from robotont_firmware import config

TEXT = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in TEXT.splitlines()
    if re.match(r"\| [0-9] \| ", line)
]


def test_wiring_table():
    expected = set()
    for motor in range(config.WHEELS):
        pin_a, pin_b, timer, function = config.ENCODERS[motor]
        pwm, pwm_timer, channel, pwm_function = config.PWM[motor]
        forward, backward = config.DIRECTIONS[motor]
        expected |= {
            (str(motor), "encoder A", pin_a, f"TIM{timer} channel 1", f"AF{function}"),
            (str(motor), "encoder B", pin_b, f"TIM{timer} channel 2", f"AF{function}"),
            (str(motor), "PWM", pwm, f"TIM{pwm_timer} channel {channel}", f"AF{pwm_function}"),
            (str(motor), "forward", forward, "", ""),
            (str(motor), "backward", backward, "", ""),
            (str(motor), "fault", config.FAULTS[motor], "", ""),
        }
    assert {(row[0], row[1], row[2], row[4], row[5]) for row in ROWS} == expected
    pins = [row[2] for row in ROWS]
    assert len(set(pins)) == len(pins), "a pin is used twice"


def test_moved_wires():
    moved = re.findall(r"^\| M(\d) \(\d+°\) \| ([AB]) \| (\w+) \| (\w+) \|$", TEXT, flags=re.MULTILINE)
    assert len(moved) == 4
    wiring = runpy.run_path(str(SRC / "robotont_firmware" / "pin_profile_robotont21.py"))
    for motor, channel, _, pin in moved:
        assert wiring["ENCODERS"][int(motor)]["AB".index(channel)] == pin
