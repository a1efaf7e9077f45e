"""A board whose clock is even however busy the machine is, in a process of its own, and what its packets said when.

python3 -m robotont_testing.even_board LINK LOG HOLD

Its wheels turn at random; HOLD packets wait for the next one. LOG gets a line `second count count ...` per period: the
end of the period on the steady clock, and the counts. Ends when its standard input does.
"""

import contextlib
import os
import random
import sys

import numpy as np

from robotont_testing.stand_in_board import Board

PERIOD = 0.02  # [s]
FASTEST = 20   # [edges per period]
CORRUPT = 0.001  # part of the bytes that are spoilt


class EvenBoard(Board):
    """A `Board` of which each period's end and counts are written to the file `log`."""

    def __init__(self, link, log):
        super().__init__(link)
        self._log = log
        self._random = random.Random(3)

    def _tick(self, now):
        self._commanded_at = now
        self._speeds = [self._random.randint(-FASTEST, FASTEST) for _ in range(self.wheels)]
        self._log.write(" ".join(map(str, (self.due - PERIOD, *self._speeds))) + "\n")
        super()._tick(now)


def hurry():
    """Run before all other processes where that is allowed: a real board is not kept waiting by the PC's work."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))


def numbers_of(published, sent):
    """Numbers, K, of published packets among those that the board sent; packets were repaired, none is missing.

    published: K x n counts; sent: M x n counts, random ones. Raises AssertionError unless most of them agree.
    """
    agreeing = np.concatenate([np.flatnonzero((sent == packet).all(axis=1)) - index
                               for index, packet in enumerate(published)])
    shifts, votes = np.unique(agreeing, return_counts=True)
    assert votes.max() > len(published) / 2, f"{votes.max()} of {len(published)} packets agree: one is missing"
    return np.arange(len(published)) + shifts[votes.argmax()]


def main():
    """Run until standard input ends."""
    link, log, hold = sys.argv[1:]
    hurry()
    with open(log, "w", buffering=1 << 16) as file:
        board = EvenBoard(link, file)
        board.line.corrupt, board.line.hold = CORRUPT, int(hold)
        with board:
            sys.stdin.read()


if __name__ == "__main__":
    main()
