"""Runs on the emulated board with one instruction a nanosecond: what one period costs, in instructions.

The peripherals are stand-ins that do nothing, so that board.py's own work is counted and the chip's is not.
"""

import gc
import sys
import time


class Nothing:
    """Any peripheral. Its methods are the interpreter's own functions, which cost about as little as the chip's."""

    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP, ENC_AB, PWM = range(7)

    def __init__(self, _=None, mode=None, *__, **___):
        self.value = time.ticks_ms if mode == Nothing.IN else bool  # never 0: no fault
        self.pulse_width = self.callback = self.feed = bool
        self.counter = lambda: turned

    def channel(self, *_, **__):
        return self

    def write(self, _, __):
        pass

    def any(self):
        return len(LINE)

    def readinto(self, buffer, size):
        buffer[:size] = LINE
        return size


class Pyb:
    Pin = Timer = UART = Nothing
    repl_uart = print
    disable_irq = enable_irq = staticmethod(bool)


class Machine:
    WDT = Nothing
    mem16 = mem32 = {}  # noqa: RUF012

    @staticmethod
    def reset_cause():
        return 0


class Memory(dict):
    def __getitem__(self, address):
        return 0


Machine.mem16 = Machine.mem32 = Memory()
sys.modules["pyb"], sys.modules["machine"] = Pyb, Machine

from robotont_firmware import board, config  # noqa: E402
from robotont_firmware.main_loop import Controller  # noqa: E402

LINE = bytearray(b"-120.55:-119.75:-118.25;")
from robotont_firmware.protocol import crc16  # noqa: E402

LINE += b"%04X\n" % crc16(LINE, len(LINE))
TIMES = 200


def instructions(function):
    """Instructions of one call, the loop's own excluded."""
    gc.collect()
    start = time.ticks_us()
    for _ in range(TIMES):
        function(1)
    middle = time.ticks_us()
    for _ in range(TIMES):
        nothing(1)
    end = time.ticks_us()
    return (time.ticks_diff(middle, start) - time.ticks_diff(end, middle)) * 1000 // TIMES


turned = 0


def nothing(_):
    pass


class Bare:
    """A board that costs nothing itself."""

    def __init__(self):
        self.total = 0

    def counts(self, totals):
        self.total = (self.total - 119) & 0xFFFF
        for wheel in range(3):
            totals[wheel] = self.total

    def drive(self, wheel, effort):
        pass

    def fault(self, wheel):
        return False

    def read(self, buffer):
        buffer[: len(LINE)] = LINE
        return len(LINE)

    def write(self, buffer, size):
        pass


bare = Controller(Bare(), config, reset_cause="test")
bare.start()
print("whole period without board.py", instructions(bare.step))
print("read one command", instructions(lambda _: bare._receiver.feed(LINE, len(LINE))))
print("one wheel's controller", instructions(lambda _: bare._pids[0].step(-30720, -119, 1, 30720)))
fields = bare._status.fields
print("write one packet", instructions(lambda _: bare._sender.pack(77, bare._counts, bare._totals, fields)))
hardware = board.Board(config)
whole = Controller(hardware, config, reset_cause="test")
hardware.start(whole)


def period(_):
    global turned  # noqa: PLW0603
    turned = (turned - 119) & 0xFFFF  # as commanded: no fault ends the drive
    hardware._tick(None)
    hardware.wait_tick()
    whole.step(1)
    hardware.feed()


print("whole period with board.py on stand-ins", instructions(period))
print("free heap", gc.mem_free())
