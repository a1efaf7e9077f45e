"""How uncertain counts are: two independent errors, whose constants stand here once."""

import math

import numpy as np

TRUST = 12              # [windows] that the first guess counts for, ...
MEMORY = 1500           # [windows] ... of so many, 5 min of driving, in which the wheels' noise is learnt
DRIVEN = 50.0           # [edges] mean path of the wheels in a window that says something about it
BOUNDS = 1 / 3, 4.0     # times `wheel_noise`

# [edges^2] Variance of the quantisation error of one encoder reading: uniform over one edge. Counts are differences
# of readings, so the errors cancel from packet to packet: of a path, however long, two readings' errors remain.
READING_VARIANCE = 1.0 / 12.0
PATH_VARIANCE = 2 * READING_VARIANCE


def variance_per_edge(wheel_noise, metres_per_edge):
    """[edges^2 per edge], n: by how much each edge adds to the variance of a wheel's path.

    wheel_noise: standard deviation [m] of a wheel's path after 1 m, growing with the square root of the path.
    metres_per_edge: n [m].
    """
    return wheel_noise ** 2 / np.asarray(metres_per_edge)


class LearntNoise:
    """The noise of the wheels, learnt from windows in which all roll.

    window: [packets]. first: times `wheel_noise`, the guess to begin with.
    """

    def __init__(self, window, first=1.0):
        self._window = self._left = window
        self.excess = first ** 2  # variance, learnt over stated
        self._learnt = TRUST      # [windows] behind that

    @property
    def ratio(self):
        """[1] Standard deviation of the noise as learnt, over the stated one."""
        return math.sqrt(self.excess)

    def wants(self, path):
        """Whether a window with this `path` of the wheels (n) [edges] says something, and nothing that others said."""
        self._left -= 1
        if self._left > 0 or sum(map(abs, path)) < DRIVEN * len(path):
            return False
        self._left = self._window
        return True

    def learn(self, ratio):
        """Take a window's statistic over its expectation, by the noise as learnt: a little towards a mean of 1."""
        self._learnt = min(self._learnt + 1, MEMORY)
        low, high = BOUNDS
        self.excess = min(max(self.excess * (1.0 + (ratio - 1.0) / self._learnt), low ** 2), high ** 2)
