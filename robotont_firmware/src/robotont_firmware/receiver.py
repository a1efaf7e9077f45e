"""Reads commands and orders from the serial line without allocating memory; see protocol.py for their form."""

from array import array

from robotont_firmware.compat import const, micropython, ptr8, ptr32
from robotont_firmware.protocol import crc16

LINE_SIZE = const(160)  # [bytes] the longest line that is read, without its newline
MAX_UNITS = const(32767)  # the largest whole part of a command: more no counter of 16 bits shows

_NEWLINE = const(10)
_BANG = const(33)
_PLUS = const(43)
_QUESTION = const(63)
_MINUS = const(45)
_DOT = const(46)
_ZERO = const(48)
_NINE = const(57)
_COLON = const(58)
_SEMICOLON = const(59)
_COUNTER_MASK = const(0x1FFFFFFF)
_FRACTION_SCALE = const(1000000)  # six decimals are read exactly, further ones are skipped

_LEAVE = b"!repl;"  # with a valid CRC: stop the motors and give the line to MicroPython's REPL
_ASK = b"?;"  # with a valid CRC: asks for the identity
_TEST = b"!test "  # with a wheel, + or -, a semicolon and a valid CRC: drives it for a moment


@micropython.viper
def _read_number(line, at: int, numbers, wheel: int) -> int:
    """Read `-12.34` from line[at] on into numbers[wheel] [1/256]; return the index behind it, 0 if bad.

    The line ends with a newline, which ends every loop here.
    """
    text = ptr8(line)
    out = ptr32(numbers)
    negative = text[at] == _MINUS
    if negative:
        at += 1
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
    out[wheel] = 0 - value if negative else value
    return at


class Receiver:
    """Finds commands in a stream of bytes; nothing that arrives can make it raise.

    The first valid checked command makes the connection checked: plain ones are refused from then on,
    until `release`. A trailer that is there and wrong is refused always.

    `setpoints`: the newest valid command, one integer in 1/256 unit per wheel, rounded to nearest.
    `dropped`: lines refused since the start (modulo 2^29). `checked`: see above.
    `leave`: a valid `!repl;CCCC` came, so the PC wants the REPL. `asked`: a valid `?;CCCC` came; to be
    cleared with the answer. `test`: the wheel of a valid `!test 0+;CCCC`, plus 1, negative for backward; 0: none.
    """

    def __init__(self, wheels):
        self.setpoints = array("i", [0] * wheels)
        self.dropped = 0
        self.checked = False
        self.leave = False
        self.asked = False
        self.test = 0
        self._scratch = array("i", [0] * wheels)
        self._wheels = wheels
        self._line = bytearray(LINE_SIZE + 1)  # one more for the newline, which ends every scan
        self._length = 0

    def release(self):
        """Forget that the connection was checked, so that another, plain PC can take over."""
        self.checked = False

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
                if length > LINE_SIZE:
                    self._drop()
                elif length > 0 and self._read_line(length):
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
        """Return True when line[0:length] is a command to obey, which then stands in `setpoints`."""
        self._line[length] = _NEWLINE
        first = self._line[0]
        if first == _BANG or first == _QUESTION:  # noqa: PLR1714, SIM109 (a tuple would be allocated)
            self._read_order(length)
            return False
        end = self._read_numbers()
        if end > 0 and self._trailer_allows(end, length):
            self.setpoints, self._scratch = self._scratch, self.setpoints
            return True
        self._drop()
        return False

    def _drop(self):
        self.dropped = (self.dropped + 1) & _COUNTER_MASK

    def _read_order(self, length):
        """Set `leave`, `asked` or `test` when the line is one of them with its CRC."""
        line = self._line
        end = length - 4
        if end < 2 or self._read_hex(end) != crc16(line, end):
            self._drop()
        elif self._is(_LEAVE, end):
            self.leave = True
        elif self._is(_ASK, end):
            self.asked = True
        elif not self._read_test(end):
            self._drop()

    def _read_test(self, end):
        """Return True when line[0:end] is `!test 0+;`, which then stands in `test`."""
        line = self._line
        at = len(_TEST)
        if end != at + 3 or not self._is(_TEST, at) or line[at + 2] != _SEMICOLON:
            return False
        wheel = line[at] - _ZERO + 1
        sign = 1 if line[at + 1] == _PLUS else -1 if line[at + 1] == _MINUS else 0
        if sign == 0 or not 1 <= wheel <= self._wheels:
            return False
        self.test = wheel * sign
        return True

    def _is(self, order, end):
        """Return True when line[0:end] is `order`."""
        if end != len(order):
            return False
        for at in range(end):  # noqa: SIM110 (a generator would be allocated)
            if self._line[at] != order[at]:
                return False
        return True

    @micropython.native
    def _trailer_allows(self, end, length):
        """Return True when what follows the semicolon at end - 1 lets the command pass."""
        if length == end:
            return not self.checked
        if length != end + 4 or self._read_hex(end) != crc16(self._line, end):
            return False
        self.checked = True
        return True

    @micropython.viper
    def _read_hex(self, at: int) -> int:
        """Return the value of four upper-case hexadecimal digits from line[at] on, or -1."""
        line = ptr8(self._line)
        value = 0
        for index in range(at, at + 4):
            digit = line[index] - _ZERO
            if digit > 9:
                digit -= 7  # from "A" on
                if digit < 10 or digit > 15:
                    return -1
            elif digit < 0:
                return -1
            value = value << 4 | digit
        return value

    @micropython.native
    def _read_numbers(self):
        """Read `a:b:...;`, one number per wheel, into the scratch; return the index behind it, 0 if bad."""
        at = 0
        for wheel in range(self._wheels):
            at = _read_number(self._line, at, self._scratch, wheel)
            if at == 0 or self._line[at] != (_COLON if wheel < self._wheels - 1 else _SEMICOLON):
                return 0
            at += 1
        return at
