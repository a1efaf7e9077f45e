"""Which dialect a board speaks, from what it says."""

from robotont_driver.dialects import robotont2018
from robotont_driver.dialects.dialect import Dialect, DialectError, decode
from robotont_driver.dialects.pose_feedback import parse_pose
from robotont_driver.dialects.robotont2 import BANNER
from robotont_driver.dialects.robotont3 import USB_ID
from robotont_driver.protocol import CheckedPacket, LineSplitter, PacketError, parse_packet

PATIENCE = 1.0    # [s] of listening before plain packets are sent to a board that has said nothing known
OWN_BANNER = "# robotont_firmware"
LONGEST_KEPT = 4096  # [bytes] kept for the dialect that they may turn out to belong to
SHOWN = 60        # characters of what was heard, in the diagnostics


class Recognised(Dialect):
    """Listens until it knows, and then is the dialect that it has recognised.

    make(name): a new dialect; may raise DialectError. usb_id: of the port, "vendor:product"; empty when unknown.
    Until a line decides, nothing is sent; after PATIENCE plain packets are, which no other board obeys.
    """

    def __init__(self, wheels, make, usb_id):
        super().__init__(wheels)
        self._make = make
        self._usb_id = usb_id
        self._begin(0.0)

    def _begin(self, now):
        self.dialect = None     # the one that was recognised
        self._since = now
        self._now = now
        self._splitter = LineSplitter()
        self._heard = b""       # newest bytes
        self._example = ""      # newest line that nobody speaks
        self._lines = 0
        self._plain_lines = 0   # in a row; one alone may be a checked packet that lost its trailer
        self._refusal = ""

    def connect(self, now):
        """Begin a new connection: it may be another board."""
        self._keep_counters()
        self._begin(now)

    def feed(self, data, now):
        """List of count tuples, those before the recognition included."""
        self._now = now
        if self.dialect is None:
            self._heard = (self._heard + data)[-LONGEST_KEPT:]
            name = self._listen(data)
            if name is None:
                return []
            try:
                self.dialect = self._make(name)
            except DialectError as error:
                self._refusal = f"a {name} board, which cannot have these wheels: {error}"
                return []
            self.dialect.connect(now)
            data, self._heard = self._heard, b""
        packets = self.dialect.feed(data, now)
        self.packets += len(packets)
        return packets

    def _listen(self, data):
        """Name of the dialect of the first line that decides, or None."""
        for line in self._splitter.feed(data):
            self._lines += 1
            try:
                text = decode(line)
            except PacketError:
                text = repr(line)
            name = recognise(text, self.wheels.amount, self._usb_id)
            self._plain_lines = self._plain_lines + 1 if name == "plain" else 0
            if name is not None and (name != "plain" or self._plain_lines > 1):
                return name
            if text and name is None:
                self._example = text
        return None
