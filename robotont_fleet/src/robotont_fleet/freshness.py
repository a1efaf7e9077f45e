"""How old an order is, without believing anybody else's clock; free of network and clock.

The robot numbers what it says; who answers names the newest number that he has seen. An answer cannot be older than
what it answers, whatever lay between.
"""

import math
from collections import deque


class Numbered:
    """Numbers that the robot has given, and when."""

    def __init__(self, remembered=240):
        self._given = deque(maxlen=remembered)  # (number, time [s])
        self._number = 0

    def give(self, now):
        """The next number, said at time `now` [s]."""
        self._number += 1
        self._given.append((self._number, now))
        return self._number

    def age(self, number, now):
        """How old [s] an order that names this number can be at most; infinite for one that was not given."""
        return next((now - at for given, at in self._given if given == number), math.inf)
