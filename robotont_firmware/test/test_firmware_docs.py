"""The wiring table of docs/firmware.md is the wiring of config.py; its example lines are the firmware's."""

import importlib.util
import re

from firmware_pty import checked
from firmware_tools import PACKAGE, ROOT, SRC

TEXT = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in TEXT.splitlines()
    if re.match(r"\| [0-9] \| ", line)
]


def config():
    spec = importlib.util.spec_from_file_location("config", str(SRC / "robotont_firmware" / "config.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_wiring_table():
    wiring = config()
    expected = set()
    for motor in range(wiring.WHEELS):
        pin_a, pin_b, timer, function = wiring.ENCODERS[motor]
        pwm, channel = wiring.PWM[motor]
        forward, backward = wiring.DIRECTIONS[motor]
        expected |= {
            (str(motor), "encoder A", pin_a, f"TIM{timer} channel 1", f"AF{function}"),
            (str(motor), "encoder B", pin_b, f"TIM{timer} channel 2", f"AF{function}"),
            (str(motor), "PWM", pwm, f"TIM{wiring.PWM_TIMER} channel {channel}", "AF3"),
            (str(motor), "forward", forward, "", ""),
            (str(motor), "backward", backward, "", ""),
            (str(motor), "fault", wiring.FAULTS[motor], "", ""),
        }
    assert {(row[0], row[1], row[2], row[4], row[5]) for row in ROWS} == expected
    pins = [row[2] for row in ROWS]
    assert len(set(pins)) == len(pins), "a pin is used twice"


def test_repl_line():
    line = checked("!repl").decode().strip()
    assert f"`{line}`" in TEXT
    assert line in (PACKAGE / "scripts" / "flash").read_text()


def test_watchdog_and_timeout():
    wiring = config()
    assert f"watchdog ({wiring.WATCHDOG} ms)" in TEXT
    assert 0.48 <= wiring.TIMEOUT / wiring.RATE <= 0.5  # a packet may have come one period before its tick
