"""A board with a virtual clock behind a pseudo-terminal, in real time."""

import time

from robotont_testing.cable import Cable
from robotont_testing.stand_in_board import Line

TURN = 0.004  # [s] between two turns, at most ...
LATE = 0.004  # [s] ... and later than this the thread was kept: two lines 30 ms apart stay more than 20 ms apart
LOOK = 0.03   # [s] within which a board has looked at all that it heard


class BoardPort(Cable):
    """Runs a board of robotont_boards at the port `link`. `make(now)` gives a fresh board.

    `line`: faults of the line on the bytes that the board sends. `heard`: (time, bytes) of each write of the PC.
    `late`: (begin, end) of each time in which this thread was kept from its turn, so that the board heard at once what
    was sent in all that time.
    """

    def __init__(self, link, make):
        super().__init__(link)
        self.line = Line()
        self.heard = []
        self.late = []
        self._make = make
        self.restart()

    def restart(self):
        """As the reset button does."""
        self._turned = time.monotonic()  # [s] of the newest turn
        self.board = self._make(self._turned)

    def unplug(self):
        """Vanish, if not vanished already; the board stands still."""
        self.close()

    def swallowed(self):
        """(time, line) of each command that the board did not obey although it had its turns in time."""
        return [(at, line) for at, line in self.board.swallowed if self._in_time(at)]

    def pieces(self):
        """The bytes that the board heard at once, of each time that it had its turn in time."""
        return [data for at, data in self.heard if self._in_time(at)]

    def _in_time(self, at):
        return not any(begin <= at <= end + LOOK for begin, end in self.late)

    @property
    def due(self):
        """[s] of the next turn."""
        return min(self.board.next_event, self._turned + TURN)

    def hear(self, data, now):
        """The PC has written."""
        self.heard.append((now, data))
        self.board.receive(data, now)

    def turn(self, now):
        """Let the board's time pass."""
        if now > self.due + LATE:
            self.late.append((self.due, now))
        self._turned = now
        data = self.board.advance(now)
        if data:
            self.send(self.line.pass_on(data))
