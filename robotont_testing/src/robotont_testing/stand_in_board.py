"""A stand-in for the board: ideal motors behind a pseudo-terminal, with a line as bad as a test wants."""

import binascii
import random
import time

from robotont_testing.cable import Cable

PERIOD = 0.02          # [s]
COMMAND_TIMEOUT = 0.5  # [s]
LINE_LATENCY = 0.005   # [s] of bytes at a slow line that are looked at together


def crc16(data):
    """CRC-16/CCITT-FALSE, by the standard library: the driver has a table of its own."""
    return binascii.crc_hqx(data, 0xFFFF)


def speeds_of(line, wheels):
    """Speeds [units] of a command, plain or with the right CRC behind its semicolon; None for anything else."""
    body, semicolon, trailer = line.partition(b";")
    if trailer.strip() and trailer.strip() != b"%04X" % crc16(body + semicolon):
        return None
    try:
        speeds = [float(field) for field in body.split(b":")]
    except ValueError:
        return None
    return speeds if semicolon and len(speeds) == wheels else None


def sealed(words):
    """The text line `words` with its CRC, as boards with firmware from 2.0 on send it."""
    line = f"# {words};".encode()
    return line + b"%04X\n" % crc16(line)


def identity(wheels=3, rate=50, reset="power"):
    """Identity string of a board with firmware 2.0."""
    return f"robotont_firmware 2.0.0 wheels {wheels} rate {rate} units edges/period profile ours reset {reset}"


class Encoders:
    """Wheels that turn exactly as commanded: `turned` [edges] since the start, `counted` the whole ones of them."""

    def __init__(self, wheels):
        self.turned = [0.0] * wheels
        self.counted = [0] * wheels

    def follow(self, units):
        """Counts, n integers, of one PID period at these speeds [units]."""
        counts = []
        for wheel, unit in enumerate(units):
            self.turned[wheel] += unit
            counts.append(round(self.turned[wheel]) - self.counted[wheel])
            self.counted[wheel] += counts[-1]
        return counts


class Line:
    """Faults of one direction of the line. Rates are per byte; change them at any time."""

    def __init__(self, seed=1):
        self.random = random.Random(seed)
        self.drop = 0.0
        self.corrupt = 0.0
        self.double = 0.0
        self.hold = 0        # merge: write only when so many packets wait
        self.cut = False     # lose everything
        self.delay = 0.0     # [s] for `delayed`
        self._held = []
        self._under_way = []  # (time of arrival [s], bytes)

    def pass_on(self, packet):
        """What of a packet goes over the line now, and of those that it held; bytes."""
        if self.cut:
            return b""
        data = bytearray()
        for byte in packet:
            fate = self.random.random()
            if fate < self.drop:
                continue
            if fate < self.drop + self.corrupt:
                data.append(self.random.randrange(256))
            elif fate < self.drop + self.corrupt + self.double:
                data += bytes((byte, byte))
            else:
                data.append(byte)
        self._held.append(bytes(data))
        if len(self._held) <= self.hold:
            return b""
        together, self._held = b"".join(self._held), []
        return together

    def delayed(self, packet, now):
        """As `pass_on`, of this packet and of earlier ones what arrives at time `now` [s]; b"" for none."""
        if packet:
            arrival = max([now + self.delay, *(at for at, _ in self._under_way[-1:])])  # nothing overtakes
            self._under_way.append((arrival, self.pass_on(packet)))
        arrived = b"".join(data for at, data in self._under_way if at <= now)
        self._under_way = [(at, data) for at, data in self._under_way if at > now]
        return arrived


class Board(Cable):
    """Reads commands and sends one packet per period, from a thread of its own, at the port `link`.

    It goes on, with a battery of its own, while its cable is unplugged. `line`: faults of what it sends; `commands`:
    of what it receives. `motors.counted`: all counts since it was made, whatever has become of them.
    `heard`: (time, line) of each command line. `reported`: counts of each period in which the port was open.
    `on_period(turned)` is called with the edges that the wheels have really turned, fractions included.

    `byte_rate`: [bytes/s] at which commands arrive, as at a real line; None: at once. What comes faster waits in the
    pseudo-terminal. `stalled`: nothing arrives.

    `identity`: string with which the board identifies itself when asked; with it its packets carry a status
    (`flags`, `missed`, `refused`, and `faults` per wheel) and its text a CRC, as from firmware 2.0 on.
    """

    def __init__(self, link, wheels=3, checked=True, start_totals=0, banner="robotont stand-in 1",
                 identity=None):
        super().__init__(link)
        self.due = 0.0  # [s] when the next period begins
        self.wheels = wheels
        self.checked = checked
        self.banner = banner
        self.identity = identity
        self.flags = self.missed = self.refused = 0
        self.faults = [0] * wheels
        self.line = Line()
        self.commands = Line(seed=2)
        self.byte_rate = None
        self.stalled = False
        self._heard_until = 0.0  # [s] what has arrived so far has taken the line until then
        self.heard = []
        self.reported = []
        self.on_period = None
        self._start_totals = start_totals
        self.motors = Encoders(wheels)
        self.restart()

    def restart(self, start_totals=None):
        """Forget all, as after a reset: counter and totals restart."""
        self._counted_before = list(self.motors.counted)
        self.offset = self._start_totals if start_totals is None else start_totals
        self._speeds = [0.0] * self.wheels
        self.counter = 0
        self._commanded_at = -COMMAND_TIMEOUT
        self._says = []
        if self.banner:
            self._says.append(sealed(self.banner) if self.identity else f"# {self.banner}\n".encode())

    def say(self, data):
        """Put bytes on the line with the next packet."""
        self._says.append(data)

    def plug(self):
        """Appear at the port's name; its first period begins when it does for the first time."""
        self.due = self.due or time.monotonic()
        self._unfinished = b""
        super().plug()

    @property
    def speeds(self):
        """Speeds [units] that the wheels have now."""
        return list(self._speeds)

    def arrived(self, now):
        """Number of bytes that the line can have brought until now."""
        if self.stalled:
            return 0
        if not self.byte_rate:
            return 4096
        self._heard_until = max(self._heard_until, now - LINE_LATENCY)
        return int((now - self._heard_until) * self.byte_rate)

    def hear(self, data, now):
        """Take bytes that have arrived."""
        if self.byte_rate:
            self._heard_until += len(data) / self.byte_rate
        self._obey(self.commands.delayed(data, now), now)

    def turn(self, now):
        """Do the work of a period, if it is its time."""
        if now >= self.due:
            self.due += PERIOD
            self._tick(now)

    def _obey(self, data, now):
        *lines, self._unfinished = (self._unfinished + data).split(b"\n")
        for line in lines:
            if line == b"?;%04X" % crc16(b"?;"):
                self.answer()
                continue
            self.heard.append((now, line.decode("ascii", "replace")))
            speeds = speeds_of(line, self.wheels)
            if speeds is not None:
                self._speeds = speeds
                self._commanded_at = now

    def answer(self):
        """Send the board's identity; the line may corrupt the answer as it corrupts packets."""
        if self.identity:
            self.send(self.line.pass_on(sealed("identity " + self.identity)))

    def _tick(self, now):
        self._obey(self.commands.delayed(b"", now), now)
        if now - self._commanded_at > COMMAND_TIMEOUT:
            self._speeds = [0.0] * self.wheels
        counts = self.motors.follow(self._speeds)
        if self.connected:
            self.reported.append(counts)
        if self.on_period:
            self.on_period(self.motors.turned)
        for data in self._says:
            self.send(data)
        self._says = []
        packet = self.packet(counts)
        self.counter = (self.counter + 1) % 256
        self.send(self.line.delayed(packet, now))

    def packet(self, counts):
        """The feedback packet for the counts of one period."""
        plain = ":".join(map(str, counts))
        if not self.checked:
            return f"{plain};\n".encode()
        totals = "".join(":%04X" % ((total - before + self.offset) % 0x10000)
                         for total, before in zip(self.motors.counted, self._counted_before))
        status = ""
        if self.identity:
            faults = "".join(f"{fault:X}" for fault in self.faults)
            status = f":{self.flags:02X}{self.missed % 256:02X}{self.refused % 256:02X}{faults}"
        body = f"{plain};{self.counter:02X}{totals}{status}:".encode()
        return body + b"%04X\n" % crc16(body)
