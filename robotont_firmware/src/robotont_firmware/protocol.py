r"""Packets to the PC, and its commands and orders, without allocating memory; docs/protocol.md has the form of all.

    -19:0:19;SS:E0E0:E1E1:E2E2:FFMMRRWWWVVVLL:CCCC\n

A packet: counts, its number, encoder totals, the status and the CRC. Every intermediate value stays below 2^30 in
magnitude, where the board's small integers end and MicroPython would start to allocate.
"""

from array import array

from robotont_firmware.compat import SIGN, const, micropython, ptr8, ptr16, ptr32

LINE_SIZE = const(160)  # [bytes] the longest line that is read, without its newline
MAX_UNITS = const(32767)  # the largest whole part of a command: more no counter of 16 bits shows
_FRACTION_SCALE = const(1000000)  # six decimals are read exactly, further ones are skipped

LEAVE = const(1)  # orders: stop the motors and give the line to MicroPython's REPL
ASK = const(2)  # tell who you are
TEST = const(3)  # drive wheel 0 forward for a moment; one more: backward; then the next wheel

_NEWLINE = const(10)
_MINUS = const(45)
_DOT = const(46)
_ZERO = const(48)
_NINE = const(57)
_COLON = const(58)
_SEMICOLON = const(59)
_TEN = const(55)  # plus ten: the letter A

_CRC_TABLE = array("H", [0] * 256)  # the CRC of every single byte
for _byte in range(256):
    _crc = _byte << 8
    for _ in range(8):
        _crc = (_crc << 1) ^ 0x1021 if _crc & 0x8000 else _crc << 1
    _CRC_TABLE[_byte] = _crc & 0xFFFF


@micropython.viper
def crc16(data, end: int) -> int:
    """Return the CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF) of data[0:end] (bytes)."""
    table = ptr16(_CRC_TABLE)
    byte = ptr8(data)
    crc = 0xFFFF
    for at in range(end):
        crc = ((crc & 0xFF) << 8) ^ table[(crc >> 8) ^ byte[at]]
    return crc


def line_of(text):
    """Return `text;` as a line with its CRC, bytes. Allocates: for start-up and the end."""
    line = f"{text};".encode()
    return line + b"%04X\n" % crc16(line, len(line))


@micropython.viper
def is_sealed(line, end: int) -> int:
    """Return 1 where the CRC of line[0:end] (bytes) and a newline stand behind that, else 0."""
    text = ptr8(line)
    crc = int(crc16(line, end))
    for at in range(end, end + 4):
        digit = crc >> 12 & 15
        if text[at] != (digit + _ZERO if digit < 10 else digit + _TEN):
            return 0
        crc = (crc & 0xFFF) << 4
    return 1 if text[end + 4] == _NEWLINE else 0


@micropython.viper
def put_hexes(buffer, at: int, numbers, shape, amount: int) -> int:
    """Write numbers (16 bits each) in upper-case hexadecimal from buffer[at] on; return the index behind.

    shape: bytes, the digits of each, and 8 more where a colon comes before it.
    """
    out = ptr8(buffer)
    values = ptr16(numbers)
    digits = ptr8(shape)
    for index in range(amount):
        if digits[index] & 8:
            out[at] = _COLON
            at += 1
        value = values[index]
        shift = (digits[index] & 7) * 4
        while shift > 0:
            shift -= 4
            digit = (value >> shift) & 15
            out[at] = digit + _ZERO if digit < 10 else digit + _TEN
            at += 1
    return at


@micropython.viper
def _put_decimals(buffer, numbers, amount: int) -> int:
    """Write integers (|value| < 2^30) as `a:b:...;` from the beginning of the buffer; return the index behind it."""
    out = ptr8(buffer)
    values = ptr32(numbers)
    sign = int(SIGN)
    at = 0
    for index in range(amount):
        value = values[index] << sign >> sign
        if value < 0:
            out[at] = _MINUS
            at += 1
            value = 0 - value
        scale = 1
        while value // scale >= 10:
            scale *= 10
        while scale > 0:
            out[at] = _ZERO + value // scale % 10
            at += 1
            scale //= 10
        out[at] = _COLON
        at += 1
    out[at - 1] = _SEMICOLON
    return at


class Sender:
    """Writes feedback packets into one buffer, made once.

    `buffer[0:length]` is what to send, where `length` is what `pack` returned.
    """

    def __init__(self, wheels):
        self.buffer = bytearray(45 + 13 * wheels)
        self._wheels = wheels
        self._number = array("H", [0])
        self._digits = bytes([2]), bytes([8 + 4] * wheels), bytes([8 + 2, 2, 2] + [1] * wheels + [3, 2]), bytes([4])

    def pack(self, counter, counts, totals, status):
        """Write a feedback packet; return its length [bytes].

        counter: packet counter, its low 8 bits are sent. counts: edges of this period, one integer per
        wheel, within +-32768 (array "i"). totals: each encoder's total, 0..65535 (array "H"). status (array "H"):
        flags, missed ticks, refused lines (low 8 bits of each are sent), each wheel's fault, 0..15, the battery's
        voltage (12 bits) and the load (8 bits).
        """
        buffer = self.buffer
        number = self._number
        digits = self._digits
        number[0] = counter & 0xFF
        at = put_hexes(buffer, _put_decimals(buffer, counts, self._wheels), number, digits[0], 1)
        at = put_hexes(buffer, at, totals, digits[1], self._wheels)
        at = put_hexes(buffer, at, status, digits[2], len(status)) + 1
        buffer[at - 1] = _COLON
        number[0] = crc16(buffer, at)
        at = put_hexes(buffer, at, number, digits[3], 1)
        buffer[at] = _NEWLINE
        return at + 1


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
