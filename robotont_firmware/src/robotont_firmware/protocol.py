r"""Packets of the serial line, read and written without allocating memory.

PC to board: set-points in units, `-18.90:0.00:18.90;\n` (plain) or `-18.90:0.00:18.90;1050\n` (checked).
Board to PC: `-19:0:19;SS:E0E0:E1E1:E2E2:FFMMRRWWW:CCCC\n`, the edges of one period, always checked.
CCCC is the CRC-16/CCITT-FALSE of every byte before it, SS the packet counter, EEEE each encoder's total
modulo 2^16, all in upper-case hexadecimal. FFMMRRWWW is the board's status: flags, missed ticks and refused
lines modulo 256, and one digit per wheel: what is wrong with it (robotont_firmware.fault_watch).
Readable text, too: `# text;CCCC\n`. The PC may send `?;CCCC\n` (asks for the identity) and `!repl;CCCC\n`.

Numbers are integers in 1/256 unit. Every intermediate value stays below 2^30 in magnitude, where the
board's small integers end and MicroPython would start to allocate.
"""

from array import array

from robotont_firmware.compat import const, micropython, ptr8, ptr16, ptr32

LINE_SIZE = const(160)  # [bytes] the longest line that is read, without its newline
MAX_UNITS = const(999)  # the largest whole part of a command; clearly more than any motor reaches

# Flags of the status field.
TIMED_OUT = const(1)  # no valid command for TIMEOUT: the motors are off
WAITS_FOR_ZERO = const(2)  # after a fault, or a start that was not requested: a command of all zeros is needed
BATTERY_IS_LOW = const(4)

_NEWLINE = const(10)
_BANG = const(33)
_QUESTION = const(63)
_MINUS = const(45)
_DOT = const(46)
_ZERO = const(48)
_NINE = const(57)
_COLON = const(58)
_SEMICOLON = const(59)
_TEN = const(55)  # plus ten: the letter A
_COUNTER_MASK = const(0x1FFFFFFF)
_FRACTION_SCALE = const(1000000)  # six decimals are read exactly, further ones are skipped

_LEAVE = b"!repl;"  # with a valid CRC: stop the motors and give the line to MicroPython's REPL
_ASK = b"?;"  # with a valid CRC: asks for the identity


def _crc_table():
    """Return the CRC of every single byte: 256 integers of 16 bits."""
    table = array("H", [0] * 256)
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1
        table[byte] = crc & 0xFFFF
    return table


_CRC_TABLE = _crc_table()


@micropython.viper
def crc16(data, end: int) -> int:
    """Return the CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF) of data[0:end] (bytes)."""
    table = ptr16(_CRC_TABLE)
    byte = ptr8(data)
    crc = 0xFFFF
    for at in range(end):
        crc = ((crc & 0xFF) << 8) ^ table[(crc >> 8) ^ byte[at]]
    return crc


def seal(text):
    """Return `# text` as a line with its CRC, bytes. Allocates: for start-up and the end."""
    line = f"# {text};".encode()
    return line + b"%04X\n" % crc16(line, len(line))


@micropython.viper
def put_decimal(buffer, at: int, value: int) -> int:
    """Write the integer `value` (|value| < 2^30) in decimal from buffer[at] on; return the index behind."""
    out = ptr8(buffer)
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
    return at


@micropython.viper
def put_hex(buffer, at: int, value: int, digits: int) -> int:
    """Write `value` as `digits` upper-case hexadecimal digits from buffer[at] on; return the index behind."""
    out = ptr8(buffer)
    shift = 4 * digits
    while shift > 0:
        shift -= 4
        digit = (value >> shift) & 15
        out[at] = digit + _ZERO if digit < 10 else digit + _TEN
        at += 1
    return at


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
    cleared with the answer.
    """

    def __init__(self, wheels):
        self.setpoints = array("i", [0] * wheels)
        self.dropped = 0
        self.checked = False
        self.leave = False
        self.asked = False
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
        """Set `leave` or `asked` when the line is one of them with its CRC."""
        if self._is_order(_LEAVE, length):
            self.leave = True
        elif self._is_order(_ASK, length):
            self.asked = True
        else:
            self._drop()

    def _is_order(self, order, length):
        """Return True when the line is `order` and its CRC."""
        end = len(order)
        if length != end + 4:
            return False
        for at in range(end):
            if self._line[at] != order[at]:
                return False
        return self._read_hex(end) == crc16(self._line, end)

    @micropython.native
    def _trailer_allows(self, end, length):
        """Return True when what follows the semicolon at end - 1 lets the command pass."""
        if length == end:
            return not self.checked
        if length != end + 4 or self._read_hex(end) != crc16(self._line, end):
            return False
        self.checked = True
        return True

    @micropython.native
    def _read_hex(self, at):
        """Return the value of four upper-case hexadecimal digits from line[at] on, or -1."""
        value = 0
        for index in range(at, at + 4):
            digit = self._line[index] - _ZERO
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


class Sender:
    """Writes feedback packets into one buffer, made once.

    `buffer[0:length]` is what to send, where `length` is what `pack` returned.
    """

    def __init__(self, wheels):
        self.buffer = bytearray(40 + 13 * wheels)
        self._wheels = wheels

    @micropython.native
    def pack(self, counter, counts, totals, status):
        """Write a feedback packet; return its length [bytes].

        counter: packet counter, its low 8 bits are sent. counts: edges of this period, one integer per
        wheel, within +-32768. totals: each encoder's total, 0..65535. status: flags, missed ticks, refused
        lines (low 8 bits of each are sent), then each wheel's fault, 0..15.
        """
        buffer = self.buffer
        wheels = self._wheels
        at = 0
        for wheel in range(wheels):
            if wheel > 0:
                buffer[at] = _COLON
                at += 1
            at = put_decimal(buffer, at, counts[wheel])
        buffer[at] = _SEMICOLON
        at = put_hex(buffer, at + 1, counter, 2)
        for wheel in range(wheels):
            buffer[at] = _COLON
            at = put_hex(buffer, at + 1, totals[wheel], 4)
        buffer[at] = _COLON
        at += 1
        for index in range(3):
            at = put_hex(buffer, at, status[index], 2)
        for wheel in range(wheels):
            at = put_hex(buffer, at, status[3 + wheel], 1)
        buffer[at] = _COLON
        at += 1
        at = put_hex(buffer, at, crc16(buffer, at), 4)
        buffer[at] = _NEWLINE
        return at + 1
