"""What waits for the serial line: of commands only the newest, and no faster than the board can take lines."""

import contextlib
import fcntl
import os
import sys
import termios
from collections import deque

MOST_ADDED = 100  # lines


class Outbox:
    """The newest command that was `put`, until it is written; one line at a time.

    added: lines (bytes) that can wait until no command does; any thread may append to it.
    byte_time: [s] that the serial line needs for a byte; 0: none. Times `now` [s] are the caller's.
    """

    def __init__(self, byte_time=0.0):
        self.pacing = 0.0  # [s] least time between the beginnings of two lines
        self._byte_time = byte_time
        self._command = b""
        self.added = deque(maxlen=MOST_ADDED)
        self._free_at = 0.0      # [s] from when on a line may be written
        self._pause = 0.0        # [s] behind the newest line
        self._rest = b""         # of a line that is half written: it must be finished first
        self.sent = 0            # lines

    def __bool__(self):
        """Whether anything has still to be written."""
        return bool(self._rest or self._command or self.added)

    def put(self, command):
        """A command (bytes), which replaces one that still waits."""
        self._command = command

    def write(self, descriptor, clock):
        """Write to a port what it takes now.

        Its driver holds no line before the next: it may join it, and a command would wait behind old ones.
        """
        with contextlib.suppress(BlockingIOError):
            while self._rest or (self and not waiting_bytes(descriptor)):
                self._rest = self._rest or self.take(clock())
                if not self._rest:
                    return
                self._rest = self._rest[os.write(descriptor, self._rest):]
                self.written(clock())

    def take(self, now):
        """The line to write now; empty when there is none, or it is too early."""
        if now < self._free_at or not (self._command or self.added):
            return b""
        line, self._command = self._command or self.added.popleft(), b""
        self._pause = max(self.pacing, len(line) * self._byte_time)
        self.sent += 1
        self.written(now)
        return line

    def written(self, now):
        """The line is out, which may be a while after `take`: the pause behind it begins now."""
        self._free_at = now + self._pause

    def wait(self, now):
        """[s] until the next line may be written."""
        return max(0.0, self._free_at - now)


def waiting_bytes(descriptor):
    """Bytes written to a port that its driver has not sent yet."""
    return int.from_bytes(fcntl.ioctl(descriptor, termios.TIOCOUTQ, b"\0\0\0\0"), sys.byteorder)
