"""How uncertain counts are: two independent errors, whose constants stand here once."""

import math

import numpy as np

TRUST, MEMORY = 6, 600  # [windows of 0.5 s] that the first guess counts for; in which noise is learnt: 5 min
DRIVEN = 0.02            # [m] mean way of the wheels in a window that says something about it
FIRST, BOUNDS = 2.0, (1 / 3, 4.0)  # times `wheel_noise`: until it has been learnt; always

# [edges^2] Variance of the quantisation error of one encoder reading: uniform over one edge. Counts are differences
# of readings, so the errors cancel from packet to packet: of a path, however long, two readings' errors remain.
READING_VARIANCE = 1.0 / 12.0
PATH_VARIANCE = 2 * READING_VARIANCE


def variance_per_edge(wheel_noise, metres_per_edge):
    """[edges^2 per edge], n: by how much each edge adds to the variance of a wheel's path.

    wheel_noise: standard deviation of a wheel's path after 1 m, growing with the root of the path [m per root m].
    metres_per_edge: n [m].
    """
    return wheel_noise ** 2 / np.asarray(metres_per_edge)


class LearntNoise:
    """The noise of the wheels, learnt while all roll: `variance` [m^2 per m], `ratio` of its root to what is stated."""

    def __init__(self, wheel_noise):
        self._stated, self._learnt, self.ratio = wheel_noise, TRUST, FIRST

    @property
    def variance(self):
        """[m^2 per m] of the way."""
        return (self.ratio * self._stated) ** 2

    def learn(self, ratio, way):
        """Take a window's statistic over its expectation by the noise as learnt, and the wheels' mean way [m] in it."""
        if way >= DRIVEN:
            self._learnt = min(self._learnt + 1, MEMORY)
            ratio = self.ratio * math.sqrt(max(0.0, 1.0 + (ratio - 1.0) / self._learnt))
            self.ratio = min(max(ratio, BOUNDS[0]), BOUNDS[1])
