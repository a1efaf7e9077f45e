"""The board's end of a pseudo-terminal that can be unplugged and that corrupts bytes on request."""

import contextlib
import os
import random
import tty

from robotont_driver.link import serial_port


class Port:
    """A serial port under the name `link`, once it is plugged in.

    byte_errors: share of bytes that become random, both ways; without spoil_commands from the board to the PC only.
    """

    def __init__(self, link, seed=0, spoil_commands=True):
        self.link, self._spoil_commands = link, spoil_commands
        self.byte_errors = 0.0
        self._random = random.Random(seed)
        self._master = -1  # unplugged

    def plug(self):
        """Appear, if not there. Raises ValueError when the name cannot be used, or belongs to another process."""
        if self._master >= 0:
            return
        if os.path.lexists(self.link) and not os.path.islink(self.link):
            raise ValueError(f"{self.link}: found something that is no link, allowed: a new name")
        if os.path.exists(self.link) and not serial_port.refusal(self.link):  # no program's terminal by now
            raise ValueError(f"{self.link}: leads to {os.readlink(self.link)}, which is in use: end the simulator that "
                             "has it, choose another name (port:=NAME), or remove the link")
        master, slave = os.openpty()
        try:
            tty.setraw(slave)
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self.link)  # that a killed simulator has left
            os.symlink(os.ttyname(slave), self.link)
        except OSError as error:
            os.close(master)
            raise ValueError(f"{self.link!r}: {os.strerror(error.errno).lower()}; allowed: a new name of your own in a "
                             f"folder that you may write to, as port:=/tmp/robotont_{os.getuid()}") from None
        finally:
            os.close(slave)
        os.set_blocking(master, False)
        self._master = master

    def unplug(self):
        """Vanish, name and line."""
        if self._master >= 0:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self.link)
            os.close(self._master)
            self._master = -1

    def read(self, size):
        """At most `size` bytes that the PC has written."""
        try:
            data = os.read(self._master, size)
        except OSError:  # there is nothing, no process has the port open, or it is unplugged
            return b""
        return self._spoil(data) if self._spoil_commands else data

    def write(self, data):
        """Send bytes to the PC; lost while unplugged, or when no process reads."""
        with contextlib.suppress(OSError):
            os.write(self._master, self._spoil(data))

    def _spoil(self, data):
        return bytes(self._random.randrange(256) if self._random.random() < self.byte_errors else byte
                     for byte in data)
