"""The board's end of a pseudo-terminal that can be unplugged and that spoils bytes when told to."""

import contextlib
import os
import random
import select
import tty


class Port:
    """A serial port under the name `link`; plugged in from the start.

    byte_errors: rate of bytes that are replaced by random ones, both ways, or only from the board to the PC where
    `spoil_commands` is false.
    """

    spoil_commands = True

    def __init__(self, link, seed=0):
        self.link = link
        self.byte_errors = 0.0
        self._random = random.Random(seed)
        self._master = None
        self.plug()

    @property
    def plugged(self):
        """Whether the port exists."""
        return self._master is not None

    def plug(self):
        """Appear. Raises OSError when the name is taken by something else than a link of an earlier run."""
        if self.plugged:
            return
        if os.path.islink(self.link) and not os.path.exists(self.link):
            os.unlink(self.link)  # left behind by a simulator that was killed
        master, slave = os.openpty()
        tty.setraw(slave)
        try:
            os.symlink(os.ttyname(slave), self.link)
        except OSError:
            os.close(master)
            raise
        finally:
            os.close(slave)
        os.set_blocking(master, False)
        self._master = master

    def unplug(self):
        """Vanish, name and line."""
        if self.plugged:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self.link)
            os.close(self._master)
            self._master = None

    def read(self, size):
        """At most `size` bytes that the PC has written."""
        if not self.plugged or not select.select([self._master], [], [], 0)[0]:
            return b""
        try:
            data = os.read(self._master, size)
            return self._spoil(data) if self.spoil_commands else data
        except OSError:  # nobody has the port open
            return b""

    def write(self, data):
        """Send bytes to the PC; lost while unplugged, or when nobody reads."""
        if self.plugged:
            with contextlib.suppress(OSError):
                os.write(self._master, self._spoil(data))

    def _spoil(self, data):
        if not self.byte_errors:
            return data
        return bytes(self._random.randrange(256) if self._random.random() < self.byte_errors else byte
                     for byte in data)
