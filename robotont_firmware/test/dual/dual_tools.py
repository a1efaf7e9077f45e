"""What the suites share: golden vectors, configurations, running with the heap locked."""

import json
import sys

from sim_motor import SimBoard, SimMotor

from robotont_firmware import config
from robotont_firmware.main_loop import Controller

try:
    import micropython

    lock, unlock = micropython.heap_lock, micropython.heap_unlock
except ImportError:  # CPython always allocates; the proof is MicroPython's
    lock = unlock = int


TIMEOUT, BRAKING, FAULT_HOLD, BLIND_TIME = 24, 100, 25, 23  # [periods] at 50 Hz
FAST = sys.implementation.name == "micropython" and sys.maxsize > 1 << 31  # machine code on the PC's processor


class Locked:
    """`with Locked():` MicroPython raises MemoryError on any allocation inside."""

    def __enter__(self):
        lock()

    def __exit__(self, kind, error, trace):
        unlock()


GOLDEN_PATH = None  # set by the runner


def golden():
    with open(GOLDEN_PATH) as file:
        return json.load(file)


class Config:
    """A copy of the firmware's configuration with some values changed."""

    def __init__(self, **changes):
        for name in dir(config):
            if name[0].isupper():
                setattr(self, name, getattr(config, name))
        for name, value in changes.items():
            setattr(self, name, value)


def profile(module):
    return Config(**{name: getattr(module, name) for name in dir(module) if name[0].isupper()})


def crc_slow(data):
    """CRC-16/CCITT-FALSE bit by bit, written apart from the firmware's."""
    crc = 0xFFFF
    for byte in data:
        for bit in range(7, -1, -1):
            high = (crc >> 15) & 1
            crc = (crc << 1) & 0xFFFF
            if high != (byte >> bit) & 1:
                crc ^= 0x1021
    return crc


def checked(body):
    """Return the line `body;` with its CRC and newline, as bytes."""
    body = body.encode() + b";"
    return body + b"%04X\n" % crc_slow(body)


ORDER, END = checked("!test 1+"), checked("!repl")


class WildBoard:
    """Allocates nothing: counters jump anywhere but for a while, lines come again, ticks are missed, a driver fails.

    The first line, zeros, comes now and then; for a while none comes, but an order `!test`. After 220 ticks it asks
    for the REPL, and has `sent` bytes.
    """

    JUMPS = (0, 150, 0xFF00, 0x7FFF, 0x8000, 400, 0xFE70, 1)

    def __init__(self, lines):
        self.lines = lines
        self.ticks = self.total = self.sent = self.fed = 0

    def wait_tick(self):
        self.ticks += 1
        assert self.ticks < 240
        return 18 if self.ticks % 50 == 7 else 1

    def counts(self, totals):
        for wheel in range(len(totals)):
            if not 60 < self.ticks < 130:
                self.total = (self.total + self.JUMPS[(self.ticks // 9 + wheel) % 8]) & 0xFFFF
            totals[wheel] = self.total

    def drive(self, wheel, effort):
        assert -10000 <= effort <= 10000

    def fault(self, wheel):
        return self.ticks == 200 and wheel == 1

    def battery(self):
        return 12000

    def read(self, buffer):
        if 90 < self.ticks < 130 and self.ticks != 120:
            return 0
        line = ORDER if self.ticks == 120 else END if self.ticks > 220 else self.lines[
            0 if self.ticks % 40 == 39 or self.ticks in (88, 90) else self.ticks // 11 % len(self.lines)]
        size = min(len(line), len(buffer))
        for at in range(size):
            buffer[at] = line[at]
        return size

    def write(self, buffer, size):
        self.sent += size

    def feed(self):
        self.fed += 1


class Robot:
    def __init__(self, wheels=3, settings=None, cause="test", battery_mv=None, **motor):
        self.board = SimBoard([SimMotor(**motor) for _ in range(wheels)])
        if battery_mv is not None:
            self.board.battery_mv = battery_mv
            self.board.battery = lambda: self.board.battery_mv
        self.controller = Controller(self.board, settings or Config(WHEELS=wheels), cause)
        self.controller.start()

    def send(self, body):
        self.board.inbox += checked(body)

    def tick(self, periods=1, command=None):
        """Run some periods; repeat `command` often enough to keep the link alive."""
        for index in range(periods):
            if command and index % 10 == 0:
                self.send(command)
            self.controller.step(self.board.wait_tick())

    def packets(self):
        """Return every feedback packet sent so far as (counts, counter, totals)."""
        found = []
        for line in self.board.sent.split(b"\n"):
            if line and line[0] != 35:
                assert crc_slow(line[:-4]) == int(line[-4:], 16), line
                counts, fields = line.split(b";")
                fields = fields.split(b":")
                found.append(
                    (
                        [int(count) for count in counts.split(b":")],
                        int(fields[0], 16),
                        [int(total, 16) for total in fields[1:-2]],
                    )
                )
                self.status = fields[-2].decode()
        return found

    def newest(self):
        """Return (flags, ticks missed, lines refused, [faults], [10 mV], [% load]) of the newest packet."""
        self.board.sent = self.board.sent[self.board.sent.rfind(b"\n", 0, -1) + 1 :]
        self.packets()
        text = self.status
        numbers = [int(part, 16) for part in (text[:2], text[2:4], text[4:6], text[-5:-2], text[-2:])]
        return tuple(numbers[:3] + [[int(digit, 16) for digit in text[6:-5]]] + numbers[3:])

    def efforts(self):
        return list(self.board._next)
