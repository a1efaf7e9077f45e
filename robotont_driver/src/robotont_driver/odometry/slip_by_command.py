"""Slip with any number of wheels: commanded and measured paths [edges], compared."""

from collections import deque

import numpy as np


class CommandWatch:
    """Compares commanded and measured paths of n >= 3 wheels, over about a second.

    frequency: [Hz] packets per second. Motors lag behind their commands, so each change of command
    excuses a difference of `LAG` times the change.
    """

    BLOCK = 0.1        # [s]
    BLOCKS = 10        # blocks in a window ...
    EARLIER = 5        # ... and before it, from which changes of command still show
    LAG = 0.3          # [s] in which a motor may follow
    SHARE = 0.3        # part of the commanded path by which a wheel may differ
    LEAST = 50.0       # [edges] by which it may differ always: motors have a least speed

    def __init__(self, wheels, frequency):
        self._packets = max(1, round(self.BLOCK * frequency))
        self._lag = self.LAG * frequency  # [packets]
        self._blocks = deque(maxlen=self.BLOCKS + self.EARLIER)
        self._last = None
        self._wheels = wheels
        self._start_block()
        self.followed = None  # per wheel: measured over commanded path of the newest window; None: hardly commanded
        self.lagging = ()     # indices of the wheels that do not follow their command

    def update(self, counts, commanded):
        """Take one packet: n counts and the n units commanded for it (None: unknown, starts again)."""
        if commanded is None:
            if self._last is not None:
                self._blocks.clear()
                self._start_block()
                self._last = None
                self.followed, self.lagging = None, ()
            return
        measured, path = self._measured, self._path
        for wheel in range(self._wheels):
            measured[wheel] += counts[wheel]
            path[wheel] += commanded[wheel]
        if commanded != self._last:
            for wheel, old in enumerate(self._last or [0.0] * self._wheels):
                self._change[wheel] += abs(commanded[wheel] - old)
            self._last = commanded
        self._left -= 1
        if not self._left:
            self._blocks.append((measured, path, self._change))
            self._start_block()
            if len(self._blocks) >= self.BLOCKS:
                self._judge()

    def _start_block(self):
        self._left = self._packets
        self._measured = [0.0] * self._wheels
        self._path = [0.0] * self._wheels      # commanded
        self._change = [0.0] * self._wheels

    def _judge(self):
        measured, commanded, change = (np.array(part) for part in zip(*self._blocks))
        measured, commanded = measured[-self.BLOCKS:].sum(axis=0), commanded[-self.BLOCKS:].sum(axis=0)
        allowed = self.LEAST + self.SHARE * abs(commanded) + self._lag * change.sum(axis=0)
        self.followed = tuple(
            float(did / wanted) if abs(wanted) > self.LEAST else None for did, wanted in zip(measured, commanded))
        self.lagging = tuple(np.flatnonzero(abs(measured - commanded) > allowed).tolist())
