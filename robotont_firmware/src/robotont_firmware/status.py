"""What every packet tells about the board: flags, counters, faults, battery and load; and what its light shows."""

from array import array

from robotont_firmware.compat import const

TIMED_OUT = const(1)  # flags: no valid command for TIMEOUT: the wheels brake, then roll
WAITS_FOR_ZERO = const(2)  # after a fault, and after every start of a board: a command of all zeros is needed
BATTERY_IS_LOW = const(4)

WHEELS = const(3)  # place of the first wheel's fault in the fields
_FLAGS, _MISSED, _REFUSED = const(0), const(1), const(2)
BEAT = const(7)  # [periods - 1, a power of 2] in which the light does not change, and at most one question is answered


class Status:
    """`fields`: array "H" as Sender.pack writes it. The board's battery, load and light are used where it has them."""

    def __init__(self, board, config, wheels):
        self.fields = array("H", [0] * (WHEELS + wheels + 2))
        self._battery = getattr(board, "battery", None)
        self._load = getattr(board, "load", None)
        self._light = getattr(board, "light", None)
        self._low = config.BATTERY_LOW
        self._rate = config.RATE
        self._low_for = 0  # [periods] that the battery has been low: a second is told
        self._mean = 0  # [mV] of the battery, over some 16 periods
        self._until = 0  # [periods] until voltage and load are taken anew

    def update(self, flags, periods, refused):
        """Bring all but the faults up to date, `periods` ticks after the last time."""
        fields = self.fields
        fields[_MISSED] = (fields[_MISSED] + periods - 1) & 0xFF
        fields[_REFUSED] = refused
        if self._battery is not None:
            voltage = self._battery()
            self._mean = voltage if self._mean == 0 else self._mean + ((voltage - self._mean) >> 4)
            self._low_for = 0 if voltage >= self._low else min(self._low_for + periods, self._rate)
            if self._low_for == self._rate:
                flags |= BATTERY_IS_LOW
        fields[_FLAGS] = flags
        self._until -= periods
        if self._until <= 0:
            self._until = self._rate
            fields[-2] = min(self._mean // 10, 0xFFF)
            if self._load is not None:
                fields[-1] = self._load()

    def show(self, counter, driven, broken):
        """Once in a beat: blink with a fault, shine while the robot is driven, flash now and then else."""
        if self._light is not None:
            beat = counter // (BEAT + 1)
            self._light(beat & 1 if broken else driven or beat & 7 == 0)
