"""Reads commands and orders from the serial line without allocating memory; see protocol.py for their form."""

from array import array

from robotont_firmware.compat import const, micropython, ptr8, ptr32
from robotont_firmware.protocol import crc16, line_of, put_hexes

LINE_SIZE = const(160)  # [bytes] the longest line that is read, without its newline
MAX_UNITS = const(32767)  # the largest whole part of a command: more no counter of 16 bits shows

_NEWLINE = const(10)
_MINUS = const(45)
_DOT = const(46)
_ZERO = const(48)
_NINE = const(57)
_COLON = const(58)
_SEMICOLON = const(59)
_FOUR = b"\x04"  # digits
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
        start = at
        value = 0
        byte = text[at]
        while byte >= _ZERO and byte <= _NINE:
            if value <= MAX_UNITS:
                value = value * 10 + byte - _ZERO
            at += 1
            byte = text[at]
        if at == start or value > MAX_UNITS:
            return 0
        value <<= 8
        if byte == _DOT:
            at += 1
            start = at
            byte = text[at]
            fraction = 0
            scale = 1
            while byte >= _ZERO and byte <= _NINE:
                if scale < _FRACTION_SCALE:
                    fraction = fraction * 10 + byte - _ZERO
                    scale *= 10
                at += 1
                byte = text[at]
            if at == start:
                return 0
            value += (fraction * 512 + scale) // (scale * 2)  # fraction / scale * 256, to nearest
        if byte != (_COLON if wheel < amount - 1 else _SEMICOLON):
            return 0
        out[wheel] = 0 - value if negative else value
        at += 1
    return at


@micropython.viper
def _is(line, at: int, text, size: int) -> int:
    """Return 1 where line[at:at + size] is `text`, else 0."""
    found, wanted = ptr8(line), ptr8(text)
    for index in range(size):
        if found[at + index] != wanted[index]:
            return 0
    return 1


class Receiver:
    """Finds commands in a stream of bytes; nothing that arrives can make it raise.

    The first valid checked command makes the connection checked; plain ones are refused from then on,
    until somebody makes `checked` False. A trailer that is there and wrong is refused always.

    `setpoints`: the newest valid command, one integer in 1/256 unit per wheel, rounded to nearest.
    `dropped`: lines refused since the start, modulo 256. `checked`: see above.
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
        self._trailer = bytearray(b"CCCC\n")
        self._crc = array("H", [0])

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
            if end > 0:
                self._crc[0] = crc16(line, end)
                put_hexes(self._trailer, 0, self._crc, _FOUR, 1)
                if _is(line, end, self._trailer, 5) if length > end else not self.checked:
                    self.checked = length > end
                    self.setpoints, self._scratch = self._scratch, self.setpoints
                    return True
            for index in range(len(self._orders)):
                order = self._orders[index]
                if _is(line, 0, order, len(order)):
                    if self.order != LEAVE:
                        self.order = index + 1
                    return False
        self.dropped = (self.dropped + 1) & 0xFF
        return False
