"""Stand-ins for `pyb` and `machine` that remember what was done and refuse what the chip cannot do."""

import sys

# Alternate functions of the STM32L476's timer pins that the board could use (its data sheet, table 17).
TIMER_PINS = {
    ("PB6", 2): (4, 1), ("PB7", 2): (4, 2), ("PA6", 2): (3, 1), ("PA7", 2): (3, 2),
    ("PA0", 1): (2, 1), ("PA1", 1): (2, 2), ("PC6", 3): (8, 1), ("PC7", 3): (8, 2), ("PC8", 3): (8, 3),
    ("PB4", 2): (3, 1), ("PB5", 2): (3, 2), ("PA8", 1): (1, 1), ("PA9", 1): (1, 2), ("PB14", 14): (15, 1),
    ("PC9", 3): (8, 4),
}  # fmt: skip

strict = [True]  # whether pins have only the chip's functions
log = []
levels = {}  # what stands on input pins
pins = {}


class Pin:
    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP = "in", "out", "af", "none", "up"

    def __init__(self, name, mode=None, pull=None, value=None, alt=None):
        self.name = name
        if mode == Pin.AF_PP:
            assert not strict[0] or (name, alt) in TIMER_PINS, (name, alt)
        if mode:
            pins[name] = [mode, alt, pull]
            log.append(f"pin {name}")
        if value is not None:
            levels[name] = value

    def value(self, level=None):
        if level is None:
            return levels.get(self.name, 1)
        assert pins[self.name][0] == Pin.OUT_PP
        levels[self.name] = 1 if level else 0


class Channel:
    def __init__(self, timer, width):
        self.timer = timer
        self.width = width

    def pulse_width(self, width):
        assert 0 <= width <= self.timer.period + 1
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
        log.append(f"timer {number}")

    def channel(self, number, mode, pin=None, pulse_width=None):
        if mode == Timer.PWM:
            places = [place for (name, _), place in TIMER_PINS.items() if name == pin.name]
            assert not strict[0] or (self.number, number) in places, pin.name
            pins[pin.name] = [Pin.AF_PP, None, None]
        self.channels[number] = (mode, Channel(self, pulse_width))
        return self.channels[number][1]

    def counter(self):
        return self.count

    def callback(self, handler):
        self.handler = handler


class UART:
    last = None

    def __init__(self, number, baudrate):
        assert "repl_uart None" in log, "the REPL still listens"
        log.append(f"uart {number}")
        self.room = 259  # [bytes] of the receive buffer, as on the chip
        self.number, self.baudrate = number, baudrate
        self.inbox = bytearray()
        self.outbox = b""
        UART.last = self

    def arrive(self, data):
        """The line brings bytes; those beyond the buffer are lost. Return how many."""
        lost = max(0, len(self.inbox) + len(data) - self.room)
        self.inbox += data[: len(data) - lost]
        return lost

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


class ADC:
    value = 0

    def __init__(self, pin):
        self.pin = pin

    def read(self):
        return ADC.value


class Memory(dict):
    """Registers that read 0 until they are written."""

    def __getitem__(self, address):
        return self.get(address, 0)


class WDT:
    broken = False

    def __init__(self, timeout):
        if WDT.broken:
            raise OSError("no watchdog")
        log.append(f"watchdog {timeout}")

    def feed(self):
        log.append("feed")


class Reset(Exception):  # noqa: N818
    pass


class Pyb:
    Pin, Timer, UART, ADC = Pin, Timer, UART, ADC
    on_wait = None
    disable_irq = staticmethod(lambda: log.append("interrupts off"))
    enable_irq = staticmethod(lambda _: log.append("interrupts on"))
    wfi = staticmethod(lambda: Pyb.on_wait())

    @staticmethod
    def repl_uart(*uart):
        if not uart:
            return "before"
        log.append(f"repl_uart {uart[0]}")


class Machine:
    PWRON_RESET, HARD_RESET, WDT_RESET, SOFT_RESET = 1, 2, 3, 0
    WDT = WDT
    cause = 2
    mem16 = Memory()  # the chip's registers
    mem32 = Memory()
    reset_cause = staticmethod(lambda: Machine.cause)

    @staticmethod
    def reset():
        log.append("reset")
        raise Reset


class Micropython:
    """main.py's door to the heap lock; these stand-ins allocate, so it only remembers."""

    heap_lock = staticmethod(lambda: log.append("heap_lock"))
    heap_unlock = staticmethod(lambda: log.append("heap_unlock"))
    kbd_intr = staticmethod(lambda character: log.append(f"kbd_intr {character}"))
    alloc_emergency_exception_buf = staticmethod(lambda size: None)


cycles = [0]  # of the processor


class Time:
    ticks_cpu = staticmethod(lambda: cycles[0])
    ticks_diff = staticmethod(lambda now, before: now - before)


def install():
    """Make main.py and board.py find these."""
    sys.modules["pyb"] = Pyb
    sys.modules["machine"] = Machine
    sys.modules["micropython"] = Micropython
    sys.modules["time"] = Time


def reset():
    """Forget everything but the backup registers, as a real reset would."""
    log.clear()
    levels.clear()
    pins.clear()
    Timer.all.clear()
    Machine.cause = 2
    Machine.mem16.clear()
    Pyb.on_wait = None
    WDT.broken = False
    UART.last = None
