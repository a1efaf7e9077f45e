"""Recognises a board's protocol from its output."""

import re

from robotont_driver.protocol.line_splitter import LineSplitter
from robotont_driver.protocol.packet import CheckedPacket, ForeignPacketError, PacketError, parse_packet
from robotont_driver.protocol.pose_feedback import parse_pose
from robotont_driver.protocol.protocol import Protocol, ProtocolError, decode
from robotont_driver.protocol.robotont2 import BANNER
from robotont_driver.protocol.robotont3 import USB_ID

PATIENCE = 1.0  # [s] of listening before a board of unknown protocol gets plain packets
OWN_BANNER = "# robotont_firmware"
ST_LINK = "0483:374b"  # USB id of a NUCLEO board's port
# What drives each board: the robot for it, as the launch files' argument.
ROBOTS = {"plain": "robot:=thesis", "checked": "robot:=thesis", "robotont2": "robot:=robotont2",
          "robotont3": "robot:=robotont3"}
FIRMWARE = {"plain": "the thesis' packets", "checked": "this project's firmware, packets with checksums",
            "robotont2": "official firmware, generations 2 and 2.1", "robotont3": "official firmware, generation 3"}
JUNE_2018 = "june 2018"
REFUSED = {JUNE_2018: "firmware of June 2018: it has no time-out and is spoken no more; flash the makers' 2.1.3 "
                      "(robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)"}
_JUNE_2018 = re.compile("(Encoders|Setpoints) -?[0-9]{1,5}:-?[0-9]{1,5}:-?[0-9]{1,5}")
LONGEST_KEPT = 4096  # [bytes]
LEAST_WHEELS = 3
SHOWN = 40  # characters of the received data in messages


def explained(name):
    """A protocol's name, and whose it is."""
    return f"{name} ({FIRMWARE[name]})"


class Listener:
    """Names the protocol of received data. usb_id: "vendor:product" of the port, if known. wheels: 0: any number.

    `fields`: numbers in the newest line before the first semicolon, the wheels of a plain or checked packet.
    """

    def __init__(self, usb_id="", wheels=0):
        self._wheels = wheels
        self._usb_id = usb_id
        self.fields = 0
        self._splitter = LineSplitter()
        self._newest = b""      # bytes
        self._example = b""     # newest line that belongs to no protocol
        self._plain_lines = 0   # in a row: one alone may be a checked packet that has lost its trailer

    def feed(self, data):
        """Name of the protocol that a line among the new bytes proves; None while none does."""
        self._newest = (self._newest + data)[-SHOWN:]
        return next(filter(None, map(self._decide, self._splitter.feed(data))), None)

    def _decide(self, line):
        try:
            text = decode(line)
        except PacketError:
            text = ""
        self.fields = text.partition(";")[0].count(":") + 1
        name = recognise(text, self._wheels or max(LEAST_WHEELS, self.fields), self._usb_id)
        self._plain_lines = self._plain_lines + 1 if name == "plain" else 0
        if name is None and line.strip():
            self._example = line.strip()
        return None if name == "plain" and self._plain_lines < 2 else name

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
            return f"no complete line received, only bytes such as {self._newest!r}: is the baudrate right?"
        return "port open, but no data from the board: is it powered, and is its firmware running?"


class Handshake(Protocol):
    """Listens until a line identifies the protocol, and uses that one from then on: see `spoken`.

    make(name): a new protocol; may raise ProtocolError. expected: the protocol that the robot's board has, any other is
    refused; empty: any that fits the wheels. Until then nothing is sent; where none is expected, plain packets are
    after PATIENCE, for a board that only receives.
    """

    def __init__(self, wheels, make, expected=""):
        super().__init__(wheels)
        self._make = make
        self._expected = expected
        self._made = {expected: make(expected)} if expected else {}  # by name: their counters outlive a connection
        self.connect(0.0)

    @property
    def spoken(self):
        """The protocol that was recognised; this one until then."""
        return self._protocol or self

    @property
    def description(self):
        """The state of the recognition, for the diagnostics."""
        if self._expected:
            return f"waiting for lines of {self._expected}"
        return "listening" if self._quiet else "plain, because no protocol was recognised"

    @property
    def complaint(self):
        """Description of the data received so far; empty when the obstacle explains it."""
        if self.obstacle:
            return ""
        return self._listener.heard

    def connect(self, now):
        """Begin a new connection: it may lead to another board."""
        self._protocol = None
        self._since = now
        self._quiet = True  # whether it is too early to send anything
        self._listener = Listener(self.usb_id, self.wheels.amount)
        self._kept = b""    # newest bytes, for the protocol that they may turn out to belong to
        self.obstacle = ""

    def tick(self, now):
        """End the silence when PATIENCE is over."""
        self._quiet = self._quiet and now - self._since < PATIENCE

    def feed(self, data, now):
        """List of `Packet`, those that led to the recognition included."""
        self.tick(now)
        if self._protocol is not None:
            return self._protocol.feed(data, now)
        self._kept = (self._kept + data)[-LONGEST_KEPT:]
        name = self._listener.feed(data)
        if name is None or not self._begin(name, now):
            return []
        data, self._kept = self._kept, b""
        return self._protocol.feed(data, now)

    def _begin(self, name, now):
        """Use the protocol from now on; returns whether it is the robot's."""
        self.obstacle = REFUSED.get(name, "")
        if self.obstacle:
            return False
        if self._expected:
            name = self._confirmed(name)
        self.obstacle = self._misfit(name)
        if self.obstacle:
            flashed = self._expected in ("robotont2", "robotont3") and name in ("plain", "checked")
            fitting = ("robot:=robotont21 for a Robotont 2 that was flashed, else " if flashed else "") + ROBOTS[name]
            self.obstacle = f"the board speaks {name}, which does not fit this robot ({self.obstacle}): {fitting}"
            return False
        self._protocol = self._made[name]
        self._protocol.connect(now)
        return True

    def _confirmed(self, name):
        """The expected protocol, where the lines are its own: generations 2 and 3 differ by their ports only."""
        wrong_port = {"robotont2": USB_ID, "robotont3": ST_LINK}.get(self._expected)
        alike = {name, self._expected} <= {"robotont2", "robotont3"}
        return self._expected if alike and self.usb_id != wrong_port else name

    def _misfit(self, name):
        """Why the robot cannot be that of a board of this protocol; empty when it can. Makes the protocol."""
        if self._expected:
            return "" if name == self._expected else f"its driver.yaml has packets: {self._expected}"
        try:
            if name not in self._made:
                self._made[name] = self._make(name)
        except ProtocolError as error:
            return str(error)
        return self._made[name].doubt

    def encode(self, command):
        """Nothing while listening; a plain packet when no protocol was recognised."""
        return b"" if self._quiet or self.obstacle or self._expected else command.text.encode("ascii")


def recognise(text, wheels, usb_id):
    """Name of the protocol that a whole line (text without its end) belongs to, or None."""
    error = refusal(CheckedPacket, text, wheels)
    if text.startswith(OWN_BANNER) or error is None or isinstance(error, ForeignPacketError):
        return "checked"
    if text == BANNER or refusal(parse_pose, text) is None:
        return "robotont3" if usb_id == USB_ID else "robotont2"
    if _JUNE_2018.fullmatch(text):
        return JUNE_2018
    return "plain" if text.endswith(";") and refusal(parse_packet, text, wheels) is None else None


def refusal(parse, *arguments):
    """The PacketError that a call raises; None where it raises none."""
    try:
        parse(*arguments)
    except PacketError as error:
        return error
    return None
