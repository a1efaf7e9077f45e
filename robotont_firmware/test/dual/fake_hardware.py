"""Stand-ins for `pyb` and `machine` that remember what was done and refuse what the chip cannot do."""

import os
import sys

# Alternate functions of the STM32L476's timer pins that the board could use (its data sheet, table 17).
TIMER_PINS = {
    ("PB6", 2): (4, 1), ("PB7", 2): (4, 2), ("PA6", 2): (3, 1), ("PA7", 2): (3, 2),
    ("PA0", 1): (2, 1), ("PA1", 1): (2, 2), ("PC6", 3): (8, 1), ("PC7", 3): (8, 2), ("PC8", 3): (8, 3),
}  # fmt: skip

log = []
levels = {}  # what stands on input pins
pins = {}


class Pin:
    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP = "in", "out", "af", "none", "up"

    def __init__(self, name, mode=None, pull=None, value=None, alt=None):
        self.name = name
        if mode == Pin.AF_PP:
            assert (name, alt) in TIMER_PINS, (name, alt)
        if mode:
            pins[name] = [mode, alt, pull]
        if value is not None:
            levels[name] = value

    def value(self, level=None):
        if level is None:
            return levels.get(self.name, 1)
        assert pins[self.name][0] == Pin.OUT_PP
        levels[self.name] = 1 if level else 0


class Channel:
    def __init__(self, width):
        self.width = width

    def pulse_width(self, width):
        assert 0 <= width <= 4000
        self.width = width


class Timer:
    ENC_AB, PWM = "encoder", "pwm"
    all = {}  # noqa: RUF012

    def __init__(self, number, freq=None, prescaler=None, period=None):
        assert number not in Timer.all or not Timer.all[number].used, "timer used twice"
        self.number, self.freq, self.prescaler, self.period = number, freq, prescaler, period
        self.used = True
        self.channels = {}
        self.count = 0
        self.handler = None
        Timer.all[number] = self

    def channel(self, number, mode, pin=None, pulse_width=None):
        if mode == Timer.PWM:
            functions = [alt for name, alt in TIMER_PINS if name == pin.name]
            assert (self.number, number) in [TIMER_PINS[(pin.name, alt)] for alt in functions], pin.name
            pins[pin.name] = [Pin.AF_PP, 3, None]
        self.channels[number] = (mode, Channel(pulse_width))
        return self.channels[number][1]

    def counter(self):
        return self.count

    def callback(self, handler):
        self.handler = handler


class UART:
    last = None

    def __init__(self, number, baudrate):
        assert "repl_uart None" in log, "the REPL still listens"
        self.number, self.baudrate = number, baudrate
        self.inbox = bytearray()
        self.outbox = b""
        UART.last = self

    def any(self):
        return len(self.inbox)

    def readinto(self, buffer, size):
        assert 0 < size <= len(self.inbox), "would wait for more"
        for at in range(size):
            buffer[at] = self.inbox[at]
        self.inbox = self.inbox[size:]
        return size

    def write(self, buffer, size):
        data = bytes(buffer[:size]) if isinstance(buffer, (bytes, bytearray)) else buffer[:size].encode()
        self.outbox += data


class WDT:
    def __init__(self, timeout):
        log.append(f"watchdog {timeout}")

    def feed(self):
        log.append("feed")


class Reset(Exception):  # noqa: N818
    pass


class Pyb:
    Pin, Timer, UART = Pin, Timer, UART
    on_wait = None

    @staticmethod
    def repl_uart(uart):
        log.append(f"repl_uart {uart}")

    @staticmethod
    def wfi():
        Pyb.on_wait()


class Machine:
    PWRON_RESET, HARD_RESET, WDT_RESET, SOFT_RESET = 1, 2, 3, 0
    WDT = WDT
    cause = 3

    @staticmethod
    def reset_cause():
        return Machine.cause

    @staticmethod
    def reset():
        log.append("reset")
        raise Reset


class Os:
    """MicroPython's os on the board; the unix port has no sync."""

    listdir, remove = os.listdir, os.remove

    @staticmethod
    def sync():
        log.append("sync")


class Micropython:
    """main.py's door to the heap lock; these stand-ins allocate, so it only remembers."""

    @staticmethod
    def heap_lock():
        log.append("heap_lock")

    @staticmethod
    def heap_unlock():
        log.append("heap_unlock")

    @staticmethod
    def alloc_emergency_exception_buf(_):
        pass


def install():
    """Make main.py and board.py find these."""
    sys.modules["pyb"] = Pyb
    sys.modules["machine"] = Machine
    sys.modules["os"] = Os
    sys.modules["micropython"] = Micropython


def reset():
    """Forget everything, as a real reset would."""
    log.clear()
    levels.clear()
    pins.clear()
    Timer.all.clear()
    Machine.cause = 3
    Pyb.on_wait = None
