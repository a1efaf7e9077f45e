"""docs/firmware.md against the profiles: the wiring table, the moved wires, and the signs that it derives in words."""

import re
import runpy

import pytest
from firmware_tools import ROOT, SRC

TEXT = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
A_LEADS_B = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]  # levels of A and B, one turn of the quadrature
OFFICIAL_FACTOR = -1  # sign by which the official firmware makes its decoder's count a speed
# Official pins (shield 1.3): DIR1, DIR2, encoder A, encoder B. A positive effort lifts DIR2 and lowers DIR1.
OFFICIAL = (("PC8", "PC9", "PC5", "PA12"), ("PB15", "PB1", "PB4", "PB13"), ("PB12", "PA7", "PC7", "PA9"))
MOVES = re.findall(r"^\| M(\d) \(\d+°\) \| ([AB]) \| (\w+) \| (\w+) \|$", TEXT, re.MULTILINE)
MOVED = {old: new for _, _, old, new in MOVES}
CHANNELS = {"PA0": 1, "PA1": 2, "PB4": 1, "PB5": 2, "PA8": 1, "PA9": 2}  # of the timers' encoder inputs


def official_count(levels):
    """Sum of what the official firmware's decoder (mbed's QEI, X4) counts: down when old B differs from new A."""
    return sum(-1 if before[1] != now[0] else 1 for before, now in zip(levels, levels[1:]))


def timer_count(levels):
    """Sum of what a timer of the STM32 counts on both edges of (channel 1, channel 2), by its reference manual."""
    total = 0
    for before, now in zip(levels, levels[1:]):
        if before[0] != now[0]:
            total += 1 if now[0] != now[1] else -1  # channel 1 rises while 2 is low, or falls while 2 is high: up
        else:
            total += 1 if now[1] == now[0] else -1  # channel 2 rises while 1 is high, or falls while 1 is low: up
    return total


@pytest.mark.parametrize(("profile", "first", "mark"), [("pin_profile", 0, ""), ("pin_profile_four", 3, r" \(four\)")])
def test_wiring_table(profile, first, mark):
    wiring = runpy.run_path(str(SRC / "robotont_firmware" / (profile + ".py")))
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in re.findall(rf"^\| [0-9]{mark} \|.*", TEXT, re.MULTILINE)]
    expected = set()
    for motor in range(first, len(wiring["ENCODERS"])):
        pin_a, pin_b = wiring["ENCODERS"][motor][:2]
        forward, backward = wiring["DIRECTIONS"][motor]
        expected |= {
            (str(motor), "encoder A", pin_a),
            (str(motor), "encoder B", pin_b),
            (str(motor), "PWM", wiring["PWM"][motor][0]),
            (str(motor), "forward", forward),
            (str(motor), "backward", backward),
            (str(motor), "fault", wiring["FAULTS"][motor]),
        }
    assert {(row[0].split()[0], row[1], row[2]) for row in rows} == expected
    pins = [row[2] for row in rows]
    assert len(set(pins)) == len(pins), "a pin is used twice"


def test_moved_wires():
    assert len(MOVES) == 4
    assert [OFFICIAL[int(motor)][2 + "AB".index(channel)] for motor, channel, *_ in MOVES] == list(MOVED)


@pytest.mark.parametrize("motor", range(3))
def test_counts_up_and_drives_forward_where_the_official_firmware_does(motor):
    wiring = runpy.run_path(str(SRC / "robotont_firmware" / "pin_profile_robotont21.py"))
    forward = A_LEADS_B if official_count(A_LEADS_B) * OFFICIAL_FACTOR > 0 else A_LEADS_B[::-1]
    dir1, dir2, pin_a, pin_b = OFFICIAL[motor]
    pins = MOVED.get(pin_a, pin_a), MOVED.get(pin_b, pin_b)
    assert wiring["ENCODERS"][motor][:2] == pins
    first = pins.index(next(pin for pin in pins if CHANNELS[pin] == 1))
    count = timer_count([(levels[first], levels[1 - first]) for levels in forward])
    assert abs(count) == 4
    assert (count < 0) == wiring["BACKWARD_ENCODERS"][motor]
    assert wiring["DIRECTIONS"][motor] == (dir2, dir1)


def test_order_and_positive_direction_are_the_wheel_files():
    text = (ROOT / "config" / "robots" / "robotont2" / "wheel_params.yaml").read_text()
    assert "[2.617994, 4.712389, 0.523599]" in text  # 60, 180, 300 degrees and a quarter turn: counterclockwise
    assert "positiveRotation: clockwise" not in text
