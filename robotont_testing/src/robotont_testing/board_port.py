"""A board with a virtual clock behind a pseudo-terminal, in real time."""

import os
import select
import threading
import time
import tty

from robotont_testing.stand_in_board import Line

LATE = 0.005  # [s]
LOOK = 0.03   # [s] within which a board has looked at all that it heard


class BoardPort:
    """Runs a board of robotont_boards at the port `link`, from a thread of its own. `make(now)` gives a fresh board.

    `line`: faults of the line on the bytes that the board sends. `heard`: (time, bytes) of each write of the PC.
    `late`: (begin, end) of each time in which this thread was kept from its turn, so that the board heard at once what
    was sent in all that time.
    """

    def __init__(self, link, make):
        self.link = link
        self.line = Line()
        self.heard = []
        self.late = []
        self._make = make
        self.board = make(time.monotonic())
        self._woken, self._wake = os.pipe()
        self._master = None
        self._thread = None

    def restart(self):
        """As the reset button does."""
        self.board = self._make(time.monotonic())

    def swallowed(self):
        """(time, line) of each command that the board did not obey although it had its turns in time."""
        return [(at, line) for at, line in self.board.swallowed if self._in_time(at)]

    def pieces(self):
        """The bytes that the board heard at once, of each time that it had its turn in time."""
        return [data for at, data in self.heard if self._in_time(at)]

    def _in_time(self, at):
        return not any(begin <= at <= end + LOOK for begin, end in self.late)

    def plug(self):
        """Appear at the port's name."""
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        if os.path.islink(self.link):
            os.unlink(self.link)
        os.symlink(os.ttyname(slave), self.link)
        os.close(slave)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def unplug(self):
        """Vanish, if not vanished already: the port's name and the line."""
        if self._master is None:
            return
        os.unlink(self.link)
        os.write(self._wake, b"!")
        self._thread.join()
        os.close(self._master)
        self._master = None

    def _run(self):
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        poller.register(self._woken, select.POLLIN)
        while True:
            due = self.board.next_event
            ready = poller.poll(max(0.0, due - time.monotonic()) * 1000)
            if any(descriptor == self._woken for descriptor, _ in ready):
                os.read(self._woken, 1)
                return
            now = time.monotonic()
            if now > due + LATE:
                self.late.append((due, now))
            if any(event & select.POLLIN for _, event in ready):
                data = self._read()
                self.heard.append((now, data))
                self.board.receive(data, now)
            elif any(event & select.POLLHUP for _, event in ready):
                time.sleep(0.001)  # no process has the port open; poll() returns at once
            self._write(self.board.advance(now))

    def _read(self):
        try:
            return os.read(self._master, 4096)
        except OSError:
            return b""

    def _write(self, data):
        left = b"".join(self.line.pass_on(data)) if data else b""
        try:
            while left:
                left = left[os.write(self._master, left):]
        except OSError:
            pass  # full, or closed at the other end: a real board does not wait either
