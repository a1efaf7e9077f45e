"""Recognises a board that sends back what it gets: a REPL, another firmware, a loop of wire."""

import contextlib
from collections import deque

from robotont_driver.protocol.line_splitter import LineSplitter

SENT_KEPT = 100   # newest lines to the board that an echo may still be of
CERTAIN = 4       # lines that came back, before it is called an echo
ZEROS = b"0:;-"    # all characters of a packet of counts while the robot is at rest


class EchoWatch:
    """Compares lines from the board with the newest lines to it. Bytes in, a decision out; pure.

    Counts may happen to be those that were commanded. So a line is evidence only where it cannot be a packet of
    counts (decimals, a command's trailer), or where it is another one than the line that came back before it: motors
    do not follow at once. A packet of counts that was not commanded like that clears the board of the suspicion.
    """

    def __init__(self):
        self.connect()

    def connect(self):
        """Begin a new connection."""
        self._splitter = LineSplitter()
        self._sent = deque(maxlen=SENT_KEPT)
        self._returned = b""
        self._witnesses = 0

    @property
    def echoing(self):
        """Whether the board is one that sends back what it gets."""
        return self._witnesses >= CERTAIN

    def sent(self, data):
        """Bytes of whole lines went to the board."""
        self._sent.extend(line for line in data.split(b"\n") if line)

    def received(self, data):
        """Bytes came from the board."""
        for line in self._splitter.feed(data):
            self._judge(line.strip())

    def _judge(self, line):
        if b";" not in line or not line.strip(ZEROS):
            return  # text, or a robot at rest: neither is evidence
        sent_lines = tuple(self._sent)  # another thread may add to them
        original = next((sent for sent in sent_lines if line.endswith(sent)), None)  # a REPL puts a prompt before it
        if original is None:
            self._witnesses = 0
            return
        with contextlib.suppress(IndexError):  # newer ones have pushed it out meanwhile
            while self._sent.popleft() != original:
                pass
        if b"." in original or not original.endswith(b";") or original != self._returned:
            self._witnesses += 1
        self._returned = original
