"""Reads commands and orders from the serial line without allocating memory; see protocol.py for their form."""

from array import array

from robotont_firmware.compat import const, micropython, ptr8, ptr32
from robotont_firmware.protocol import is_sealed, line_of

LINE_SIZE = const(160)  # [bytes] the longest line that is read, without its newline
MAX_UNITS = const(32767)  # the largest whole part of a command: more no counter of 16 bits shows

_NEWLINE = const(10)
_MINUS = const(45)
_DOT = const(46)
_ZERO = const(48)
_NINE = const(57)
_COLON = const(58)
_SEMICOLON = const(59)
_FRACTION_SCALE = const(1000000)  # six decimals are read exactly, further ones are skipped

LEAVE = const(1)  # orders: stop the motors and give the line to MicroPython's REPL
ASK = const(2)  # tell who you are
TEST = const(3)  # drive wheel 0 forward for a moment; one more: backward; then the next wheel


@micropython.viper
def _read_numbers(line, numbers, amount: int) -> int:
    """Read `-12.34:0:...;` into numbers [1/256]; return the index behind it, 0 if bad.

    The line ends with a newline, which ends every loop here.
    """
    text = ptr8(line)
    out = ptr32(numbers)
    at = 0
    for wheel in range(amount):
        negative = text[at] == _MINUS
        at += 1 if negative else 0
        byte = text[at]
        if byte < _ZERO or byte > _NINE:
            return 0
        whole = fraction = scale = 0
        while (byte >= _ZERO and byte <= _NINE) or (byte == _DOT and scale == 0):
            if byte == _DOT:
                scale = 1
            elif scale > 0:
                if scale < _FRACTION_SCALE:
                    fraction = fraction * 10 + byte - _ZERO
                    scale *= 10
            elif whole <= MAX_UNITS:
                whole = whole * 10 + byte - _ZERO
            at += 1
            byte = text[at]
        if scale == 1 or whole > MAX_UNITS or byte != (_COLON if wheel < amount - 1 else _SEMICOLON):
            return 0
        scale = scale if scale > 0 else 1
        value = (whole << 8) + (fraction * 512 + scale) // (scale * 2)  # fraction / scale * 256, to nearest
        out[wheel] = 0 - value if negative else value
        at += 1
    return at


class Receiver:
    """Finds commands in a stream of bytes; nothing that arrives can make it raise.

    The first command with a CRC makes the connection `checked`: plain ones, as a thesis' PC or a person at a terminal
    sends them, are refused from then on, until somebody makes it False. A wrong CRC is refused always.

    `setpoints`: the newest valid command, one integer in 1/256 unit per wheel, rounded to nearest.
    `dropped`: lines refused since the start, modulo 256.
    `order`: LEAVE, ASK, or TEST and what comes after it: of a valid `!repl;CCCC`, `?;CCCC`, `!test 0+;CCCC`; who obeys
    makes it 0.
    """

    def __init__(self, wheels):
        self.setpoints = array("i", [0] * wheels)
        self.dropped = 0
        self.checked = False
        self.order = 0
        self._orders = [line_of("!repl"), line_of("?")] + [line_of(f"!test {way}") for way in (
            f"{wheel}{sign}" for wheel in range(wheels) for sign in "+-")]
        self._scratch = array("i", [0] * wheels)
        self._wheels = wheels
        self._line = bytearray(LINE_SIZE + 1)  # one more for the newline, which ends every scan
        self._length = 0

    @micropython.viper
    def feed(self, data, size: int) -> int:
        """Read data[0:size] (bytes); return how many valid commands ended in it. The newest one wins."""
        accepted = 0
        text = ptr8(data)
        line = ptr8(self._line)
        length = int(self._length)
        for at in range(size):
            byte = text[at]
            if byte == _NEWLINE:
                if length > 0 and self._read_line(length):
                    accepted += 1
                length = 0
            elif length < LINE_SIZE:
                line[length] = byte
                length += 1
            else:
                length = LINE_SIZE + 1  # too long: nothing is kept until the next newline
        self._length = length
        return accepted

    @micropython.native
    def _read_line(self, length):
        """Return True when line[0:length] is a command to obey, which then stands in `setpoints`; obey an order."""
        line = self._line
        if length <= LINE_SIZE:
            line[length] = _NEWLINE
            end = _read_numbers(line, self._scratch, self._wheels)
            if end > 0 and (is_sealed(line, end) if end < length else not self.checked):
                self.checked = end < length
                self.setpoints, self._scratch = self._scratch, self.setpoints
                return True
            for index in range(len(self._orders)):
                if line.startswith(self._orders[index]):
                    if self.order != LEAVE:
                        self.order = index + 1
                    return False
        self.dropped = (self.dropped + 1) & 0xFF
        return False
