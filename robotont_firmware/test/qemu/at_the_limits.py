"""Runs on the emulated board: every number at the edge of what the constructor accepts, the heap locked.

A product beyond 31 bits would be a big integer, and so a MemoryError.
"""

import gc

import micropython

from robotont_firmware import config
from robotont_firmware import gain_bounds as bounds
from robotont_firmware.main_loop import Controller
from robotont_firmware.protocol import crc16

TUNED = (
    "MAX_SPEED", "MAX_ACCELERATION", "MAX_BRAKING", "FULL_EFFORT", "MAX_EFFORT", "MAX_TORQUE", "CONTINUOUS_TORQUE",
    "OVERLOAD_TIME", "MAX_INTEGRAL", "BLOCKED_INTEGRAL", "MAX_LOAD", "BLIND_TIME", "BLIND_SHARE", "CHANGING_SHARE",
    "BESIDE_SHARE", "WRONG_EDGES", "STATIC", "SPEED_GAIN", "P_GAIN", "I_GAIN",
    "D_GAIN", "BRAKE_GAIN", "FOLLOW", "LEAD", "TURN_LEAD", "TURN_DRAG", "ARC", "STANDSTILL", "BATTERY", "BATTERY_LOW",
    "TIMEOUT", "BRAKING", "FAULT_HOLD",
)  # fmt: skip

FAST = ("MAX_SPEED", "MAX_ACCELERATION", "P_GAIN", "I_GAIN", "D_GAIN", "SPEED_GAIN", "LEAD", "TURN_LEAD", "FOLLOW")


class Numbers:
    """A copy of the configuration."""

    def __init__(self):
        for name in dir(config):
            if name[0] != "_":
                setattr(self, name, getattr(config, name))


def accepted(numbers, name, value):
    """Return whether the configuration is accepted with that value, which it then has."""
    before = getattr(numbers, name)
    setattr(numbers, name, value)
    try:
        bounds.check(numbers)
    except ValueError:
        setattr(numbers, name, before)
        return False
    return True


def push(numbers, name, up):
    """Move a number as far as it is accepted, up or down; return it."""
    step = 1 << 28
    while step:
        while accepted(numbers, name, getattr(numbers, name) + (step if up else -step)):
            pass
        step >>= 1
    return getattr(numbers, name)


def command(values):
    line = ":".join(values).encode() + b";"
    return line + b"%04X\n" % crc16(line, len(line))


LINES = [
    command(["0", "0", "0"]),
    command(["999.999", "-999.999", "999.999"]),
    command(["-999.999", "999.999", "0.004"]),
    command(["3", "-3", "0"]),
]
JUMPS = (0, 150, 0xFF00, 0x7FFF, 0x8000, 400, 0xFE70, 1)


class WildBoard:
    """Allocates nothing: counters jump anywhere, commands at their limits, ticks are missed."""

    def __init__(self):
        self.ticks = 0
        self.total = 0

    def wait_tick(self):
        self.ticks += 1
        return 0 if self.ticks > 220 else 17 if self.ticks % 50 == 7 else 1

    def counts(self, totals):
        for wheel in range(3):
            self.total = (self.total + JUMPS[(self.ticks // 9 + wheel) % 8]) & 0xFFFF
            totals[wheel] = self.total

    def drive(self, wheel, effort):
        assert -10000 <= effort <= 10000

    def fault(self, wheel):
        return self.ticks == 200

    def battery(self):
        return 12000

    def read(self, buffer):
        if 90 < self.ticks < 120:
            return 0
        # zeros now and then, which free the motors after a fault
        line = LINES[0 if self.ticks % 40 == 39 else 1 + self.ticks // 11 % 3]
        for at in range(len(line)):
            buffer[at] = line[at]
        return len(line)

    def write(self, buffer, size):
        pass

    def feed(self):
        pass

    def stop(self):
        pass


def drive(numbers):
    """Return "ok", or the error, of a wild drive with the heap locked."""
    gc.collect()
    controller = Controller(WildBoard(), numbers, reset_cause="test")
    controller.start()
    error = None
    micropython.heap_lock()
    try:
        controller.run()
    except MemoryError as caught:
        error = caught
    finally:
        micropython.heap_unlock()
    return "ok" if error is None else repr(error)


def test(order, up):
    """Push the numbers one after the other; drive after each."""
    numbers = Numbers()
    for name in order:
        value = push(numbers, name, up)
        result = drive(numbers)
        if result != "ok":
            print("FAIL", name, value, result)
    print("ok", "up" if up else "down", order[0])


def test_one_by_one():
    """Push each number alone, both ways; drive at each edge."""
    for name in TUNED:
        for up in (True, False):
            numbers = Numbers()
            value = push(numbers, name, up)
            result = drive(numbers)
            if result != "ok":
                print("FAIL alone", name, value, result)
    print("ok alone")


def test_on_the_way():
    """Quadruple each number until it is refused; drive at each value: a product may be largest before the edge."""
    for name in TUNED:
        numbers = Numbers()
        value = max(getattr(numbers, name), 1)
        while accepted(numbers, name, value):
            result = drive(numbers)
            if result != "ok":
                print("FAIL on the way", name, value, result)
            value *= 4
    print("ok on the way")


def test_fast_with_small_gains():
    """The gains' own limits keep the speed down; without them it reaches the largest that is accepted."""
    numbers = Numbers()
    for name in FAST[1:]:
        push(numbers, name, False)
    for name in FAST:
        value = push(numbers, name, True)
        result = drive(numbers)
        if result != "ok":
            print("FAIL fast", name, value, result)
    print("ok fast", numbers.MAX_SPEED)


def test_the_lock_can_fail():
    """A configuration that `check` refuses does break the loop; otherwise this test would prove nothing."""
    keep = bounds.check
    bounds.check = lambda config: None
    numbers = Numbers()
    numbers.BRAKE_GAIN = 1 << 28
    result = drive(numbers)
    bounds.check = keep
    print("ok the lock can fail" if "MemoryError" in result else "FAIL nothing was caught: " + result)


test_the_lock_can_fail()
test_one_by_one()
test_on_the_way()
test_fast_with_small_gains()
for up in (True, False):
    test(TUNED, up)
