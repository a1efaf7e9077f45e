"""One open port and the board behind it, from the handshake to the loss: the protocol, its rate, and what is wrong."""

from robotont_driver.protocol.board_status import Identity
from robotont_driver.protocol.checked import Checked, CheckedPacket, ForeignPacketError
from robotont_driver.protocol.official_boards import BANNER, OLD, OLD_LINE, USB_ID, Robotont2, Robotont3, read_numbers
from robotont_driver.protocol.plain import Plain, parse_packet
from robotont_driver.protocol.protocol import LineSplitter, Packet, PacketError, ProtocolError, format_packet

OWN_BANNER = "# robotont_firmware"
OLD_FIRMWARE = "old"
FIRMWARE = {Plain.name: "the thesis' packets", Checked.name: "this project's firmware, packets with checksums",
            Robotont2.name: "official firmware, generations 2 and 2.1",
            Robotont3.name: "official firmware, generation 3", OLD_FIRMWARE: OLD}
LEAST_WHEELS = 3
SHOWN = 40  # characters of the received data in messages


def explained(name):
    """A protocol's name, and whose it is."""
    return f"{name} ({FIRMWARE[name]})"


def robot_for(name, fields):
    """The launch files' argument for a board of a protocol's name, with so many wheels (0: not told)."""
    if name in OFFICIAL:
        return "robot:=" + name
    return "robot:=thesis" if fields in (0, LEAST_WHEELS) else f"robot:=FOLDER_OF_{fields}_WHEELS"


class Listener:
    """Names the protocol of received data; `fields`: wheels of a plain or checked board; 0: not told."""

    def __init__(self, usb_id=""):
        self._usb_id = usb_id   # "vendor:product" of the port, if known
        self.fields = 0
        self._splitter = LineSplitter()
        self._newest = b""      # bytes
        self._example = b""     # newest line that belongs to no protocol
        self._plain_lines = 0   # in a row: one alone may be a checked packet that has lost its trailer

    def feed(self, data):
        """Name of the protocol, or OLD_FIRMWARE, that a line among the new bytes proves; None without."""
        self._newest = (self._newest + data)[-SHOWN:]
        return next(filter(None, map(self._decide, self._splitter.feed(data))), None)

    def _decide(self, line):
        text = line.decode("ascii").strip("\r") if line.isascii() else ""
        fields = 0 if text.startswith("#") else text.partition(";")[0].count(":") + 1
        identity = Identity.parse(text[2:])  # of a banner
        self.fields = identity.wheels if identity else fields
        name = recognise(text, max(LEAST_WHEELS, self.fields), self._usb_id)
        self._plain_lines = self._plain_lines + 1 if name == Plain.name else 0
        if name is None and line.strip():
            self._example = line.strip()
        return None if name == Plain.name and self._plain_lines < 2 else name

    @property
    def rest(self):
        """Beginning (bytes) of a line that has not ended yet."""
        return self._splitter.rest

    @property
    def heard(self):
        """Description of the data received so far, and of its possible cause."""
        if self._example:
            newest = repr(self._example[:SHOWN])[1:]
            if self._example.isascii() and self._example.decode().isprintable():
                return (f"lines come, but of no known protocol: {newest}; is it the right port, and does the board run "
                        "firmware of Robotont?")
            return f"lines come, but no text: {newest}; is it the right port, at the right baudrate?"
        if self._newest:
            return f"no line that tells a protocol, the newest bytes are {self._newest!r}: is the baudrate right?"
        return "port open, but no data from the board: is it powered, and is its firmware running?"


def recognise(text, wheels, usb_id):
    """Name of the protocol, or OLD_FIRMWARE, that a whole line (text without its end) belongs to, or None."""
    if text.startswith(OWN_BANNER) or reads(CheckedPacket, text, wheels):
        return Checked.name
    if text == BANNER or (text.startswith("ODOM:") and reads(read_numbers, text, 6)):
        return Robotont3.name if usb_id == USB_ID else Robotont2.name
    if OLD_LINE.match(text):
        return OLD_FIRMWARE
    return Plain.name if text.endswith(";") and reads(parse_packet, text, wheels) else None


def reads(parse, *arguments):
    """Whether a call raises no PacketError, but that of another number of wheels."""
    try:
        parse(*arguments)
    except PacketError as error:
        return isinstance(error, ForeignPacketError)
    return True


AUTO = "auto"
KINDS = {kind.name: kind for kind in (Plain, Checked, Robotont2, Robotont3)}
NAMES = (AUTO, *KINDS)
OFFICIAL = (Robotont2.name, Robotont3.name)  # their boards tell at once who they are
ST_LINK = "0483:374b"   # USB id of a NUCLEO board's port
PATIENCE = 1.0          # [s] of listening before a board of unknown protocol gets plain packets
SILENCE = 5.0           # [s] without a packet after which a board that has spoken is silent
CLOSED, LISTENING, SPEAKING, SILENT = "closed", "listening", "speaking", "silent"


class Connection:
    """Made anew whenever the port is opened; knows nothing of the one before. No data can raise out of it.

    packets: one of NAMES: plain and checked are taken at their word; an official board has to show by its lines that it
    is the robot's; auto: any that fits the wheels. Nothing is sent before the board is known, but with auto plain
    packets after PATIENCE, for a board that only receives, and a last stop. Times `now` [s] are the caller's. Raises
    ProtocolError where its board cannot have such wheels.
    """

    def __init__(self, wheels, packets=AUTO, usb_id="", now=0.0):
        self._wheels = wheels
        self._usb_id = usb_id
        self._expected = packets if packets in OFFICIAL else ""
        self.protocol = None if packets == AUTO or self._expected else KINDS[packets](wheels)
        self._listener = Listener(usb_id)
        self.opened = now    # [s]
        self._spoke = None   # [s] when the newest packet came
        self._refusal = ""   # of the board, at the handshake
        self._rate = PacketRate(wheels.pid_frequency)
        self.trouble = ""    # why the port is closed
        if self._expected:
            KINDS[self._expected](wheels)

    def state(self, now):
        """CLOSED, LISTENING (no packet yet), SPEAKING, or SILENT, where a board that has spoken does so no more."""
        if self.trouble:
            return CLOSED
        if self._spoke is None:
            return LISTENING
        return SILENT if now - self._spoke > SILENCE else SPEAKING

    @property
    def obstacle(self):
        """Why the board is not driven; empty when it is, and while nothing is known of it."""
        if self._refusal or self.protocol is None:
            return self._refusal
        return self.protocol.obstacle or ("" if self.protocol.tells_rate else self._rate.obstacle)

    @property
    def complaint(self):
        """A warning: what was heard of an unknown board, or what is odd about one that is driven; else empty."""
        if self.obstacle:
            return ""
        return self.protocol.complaint or self._rate.complaint if self.protocol else self._listener.heard

    def feed(self, data, now):
        """List of `Packet` that `data` completes."""
        if self.protocol is None:
            begun = self._listener.rest
            name = self._listener.feed(data)
            if name is None or not self._agree(name):
                return []
            data = begun + data  # the line that has told it, as a whole
        packets = self.protocol.feed(data, now)
        if packets:
            self._spoke = now
            self._rate.look(self.protocol.packets, now)
        return packets

    def _agree(self, name):
        """Use the protocol from now on; returns whether it is the robot's."""
        if self._expected and {name, self._expected} <= set(OFFICIAL):  # generations 2 and 3 differ by their ports only
            wrong_port = {Robotont2.name: USB_ID, Robotont3.name: ST_LINK}[self._expected]
            name = self._expected if self._usb_id != wrong_port else name
        if name == OLD_FIRMWARE:
            self._refusal = OLD
            return False
        fields, misfit = self._listener.fields, ""
        if self._expected and name != self._expected:
            misfit = f"its driver.yaml has packets: {self._expected}"
        elif name == Plain.name and fields != self._wheels.amount:
            misfit = f"its packets have {fields} wheels instead of {self._wheels.amount}"
        else:
            try:
                protocol = KINDS[name](self._wheels)
                misfit = "" if self._expected else protocol.misfit
            except ProtocolError as error:
                misfit = str(error)
        if misfit:
            flashed = "robot:=robotont21 for a Robotont 2 that was flashed, else " if self._expected and \
                name in (Plain.name, Checked.name) else ""
            self._refusal = (f"the board speaks {name}, which does not fit this robot ({misfit}): {flashed}"
                             + robot_for(name, fields))
            return False
        self.protocol = protocol
        if self._refusal != OLD or name not in OFFICIAL:  # old firmware sends both kinds of lines; else it was flashed
            self._refusal = ""
        return True

    @property
    def drives(self):
        """Whether a known board gets commands as they are, and no stops in their place."""
        return self.protocol is not None and self.protocol.drives and not self.obstacle

    def encode(self, command, now):
        """Bytes for a command, a `Packet`; empty while nothing may be sent."""
        if self.protocol:
            return self.protocol.stop() if self.obstacle else self.protocol.encode(command)
        listens = self._refusal or self._expected or now - self.opened < PATIENCE
        return b"" if listens else command.text.encode("ascii")

    def stop(self, now):
        """Bytes of the line that stops all wheels; empty while nothing may be sent."""
        return self.protocol.stop() if self.protocol else self.encode(Packet([0] * self._wheels.amount), now)

    def last_stop(self):
        """Bytes of the line with which a connection ends: of an unknown board the thesis' stop, which may be right."""
        return self.protocol.stop() if self.protocol else format_packet([0] * self._wheels.amount).encode("ascii")


class PacketRate:
    """Whether packets come at the robot's rate `nominal` [Hz], those of lost lines included where they are known.

    Judged by two spans in a row: a computer that stood still gets too few, then too many. `obstacle`: not driven.
    """

    SPAN = 2.0                # [s]
    ODD, WRONG = 1.1, 1.5     # times the nominal rate, or that part of it
    obstacle = complaint = ""

    def __init__(self, nominal):
        self._nominal = self._before = nominal  # [Hz]; rate of the span before
        self._begin = None         # (packets, time) of the span

    def look(self, packets, now):
        """So many packets have come until `now` [s]."""
        before, since = self._begin or (packets, now)
        if now - since >= self.SPAN:
            self._judge((packets - before) / (now - since))
            before, since = packets, now
        self._begin = before, since

    def _judge(self, rate):
        slowest, fastest = sorted((self._before, rate))
        self._before = rate
        off = max(slowest / self._nominal, self._nominal / max(fastest, 1e-3))
        words = f"{rate:.0f} packets come per second instead of {self._nominal:g} (pidControlFrequency)"
        self.complaint = words if off > self.ODD else ""
        self.obstacle = "" if off <= self.WRONG else (
            words + ": another robot's board, other firmware, or most of its lines are lost; not driven")
