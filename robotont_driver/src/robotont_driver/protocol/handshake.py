"""Tells by a board's output which protocol it speaks."""

import re

from robotont_driver.protocol.checked import Checked, CheckedPacket, ForeignPacketError
from robotont_driver.protocol.official_boards import BANNER, OLD, USB_ID, Robotont2, Robotont3, is_debug
from robotont_driver.protocol.packet import LineSplitter, PacketError, parse_packet
from robotont_driver.protocol.pose_feedback import parse_pose
from robotont_driver.protocol.protocol import Plain

OWN_BANNER = "# robotont_firmware"
# What drives each board: the robot for it, as the launch files' argument.
ROBOTS = {Plain.name: "robot:=thesis", Checked.name: "robot:=thesis", Robotont2.name: "robot:=robotont2",
          Robotont3.name: "robot:=robotont3"}
FIRMWARE = {Plain.name: "the thesis' packets", Checked.name: "this project's firmware, packets with checksums",
            Robotont2.name: "official firmware, generations 2 and 2.1",
            Robotont3.name: "official firmware, generation 3"}
JUNE_2018, BEFORE_2020 = "june 2018", "before 2020"
REFUSED = {JUNE_2018: "firmware of June 2018: it has no time-out and is spoken no more; flash the makers' 2.1.3 "
                      "(robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)",
           BEFORE_2020: OLD}
LEAST_WHEELS = 3
SHOWN = 40  # characters of the received data in messages

_JUNE_2018 = re.compile("(Encoders|Setpoints) -?[0-9]{1,5}:-?[0-9]{1,5}:-?[0-9]{1,5}")


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
        """Name of the protocol, or of a firmware in REFUSED, that a line among the new bytes proves; None without."""
        self._newest = (self._newest + data)[-SHOWN:]
        return next(filter(None, map(self._decide, self._splitter.feed(data))), None)

    def _decide(self, line):
        text = line.decode("ascii").strip("\r") if line.isascii() else ""
        self.fields = text.partition(";")[0].count(":") + 1
        name = recognise(text, self._wheels or max(LEAST_WHEELS, self.fields), self._usb_id)
        self._plain_lines = self._plain_lines + 1 if name == Plain.name else 0
        if name is None and line.strip():
            self._example = line.strip()
        return None if name == Plain.name and self._plain_lines < 2 else name

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


def recognise(text, wheels, usb_id):
    """Name of the protocol, or firmware, that a whole line (text without its end) belongs to, or None."""
    error = refusal(CheckedPacket, text, wheels)
    if text.startswith(OWN_BANNER) or error is None or isinstance(error, ForeignPacketError):
        return Checked.name
    if text == BANNER or refusal(parse_pose, text) is None:
        return Robotont3.name if usb_id == USB_ID else Robotont2.name
    if _JUNE_2018.fullmatch(text):
        return JUNE_2018
    if is_debug(text):
        return BEFORE_2020
    return Plain.name if text.endswith(";") and refusal(parse_packet, text, wheels) is None else None


def refusal(parse, *arguments):
    """The PacketError that a call raises; None where it raises none."""
    try:
        parse(*arguments)
    except PacketError as error:
        return error
    return None
