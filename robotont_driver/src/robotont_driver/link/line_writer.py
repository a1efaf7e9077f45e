"""Lines onto a serial line: whole, one at a time, and without waiting."""

import os
import time

from robotont_driver.link.exclusive_port import waiting_bytes
from robotont_driver.link.outbox import Outbox


class LineWriter:
    """Writes to a port's descriptor what waits in an `Outbox`. Its user calls it in one thread at a time.

    The driver of the port never holds more than two lines, and none before a paced one, which would join it, so that no
    command waits behind old ones. look(now) is called before a line is taken: it may replace what waits.
    """

    def __init__(self, byte_time, look):
        self.outbox = Outbox(byte_time)
        self._look = look
        self._rest = b""         # of a line that is half written: it must be finished first
        self._newest_length = 0  # [bytes] of the newest line that was written
        self.descriptor = None   # of the port; None while it is closed
        self.sent = 0            # lines

    def open(self, descriptor):
        """Forget what waited for the port as it was before."""
        self.descriptor = descriptor
        self._rest = b""
        self._newest_length = 0
        self.outbox.clear()

    @property
    def blocked(self):
        """Whether a line is half written."""
        return bool(self._rest)

    @property
    def waits(self):
        """Whether anything has still to be written."""
        return bool(self._rest or self.outbox)

    def write(self):
        """Write what the line takes now."""
        try:
            while self._rest or self._take_line():
                self._rest = self._rest[os.write(self.descriptor, self._rest):]
                if not self._rest:
                    self.outbox.written(time.monotonic())
        except OSError:
            pass  # full, or gone, which the reading thread notices by itself

    def _take_line(self):
        """Take the line to write now, if any; returns whether there is one. Raises OSError."""
        now = time.monotonic()
        self._look(now)
        if not self.outbox or waiting_bytes(self.descriptor) > (0 if self.outbox.pacing else self._newest_length):
            return False
        self._rest = self.outbox.take(now)
        if self._rest:
            self._newest_length = len(self._rest)
            self.sent += 1
        return bool(self._rest)
