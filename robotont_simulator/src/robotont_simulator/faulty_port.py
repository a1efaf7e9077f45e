"""The board's end of a pseudo-terminal that can be unplugged and that corrupts bytes on request."""

import contextlib
import os
import pwd
import random
import select
import tty

from robotont_driver.link import serial_port


class PortError(OSError):
    """A name that no port can have: found and allowed values."""


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
        """Appear. Raises PortError when the name cannot be used, or belongs to another process."""
        if self.plugged:
            return
        try:
            self._make_room()
            self._master = self._make_line()
        except OSError as error:
            if isinstance(error, PortError):
                raise
            with contextlib.suppress(OSError, KeyError):
                user = os.lstat(self.link).st_uid
                if user not in (os.geteuid(), 0):
                    raise PortError(f"{self.link}: belongs to the user {pwd.getpwuid(user).pw_name}; choose a name of "
                                    f"your own, such as port:={self.link}_{pwd.getpwuid(os.geteuid()).pw_name}"
                                    ) from None
            raise PortError(f"{self.link!r}: {os.strerror(error.errno).lower()}; allowed: a new name in a folder "
                            "that you may write to") from None

    def _make_room(self):
        """Remove the link that a killed simulator has left."""
        if not os.path.lexists(self.link):
            return
        if not os.path.islink(self.link):
            raise PortError(f"{self.link}: found something that is no link, allowed: a new name")
        if os.path.exists(self.link) and not serial_port.refusal(self.link):  # no program's terminal by now
            raise PortError(f"{self.link}: leads to {os.readlink(self.link)}, which is in use: end the simulator that "
                            "has it, choose another name (port:=NAME), or remove the link")
        os.unlink(self.link)

    def _make_line(self):
        """The board's end of a new pseudo-terminal, whose other end has the name."""
        master, slave = os.openpty()
        try:
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), self.link)
        except OSError:
            os.close(master)
            raise
        finally:
            os.close(slave)
        os.set_blocking(master, False)
        return master

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
        except OSError:  # no process has the port open
            return b""

    def write(self, data):
        """Send bytes to the PC; lost while unplugged, or when no process reads."""
        if self.plugged:
            with contextlib.suppress(OSError):
                os.write(self._master, self._spoil(data))

    def _spoil(self, data):
        if not self.byte_errors:
            return data
        return bytes(self._random.randrange(256) if self._random.random() < self.byte_errors else byte
                     for byte in data)
