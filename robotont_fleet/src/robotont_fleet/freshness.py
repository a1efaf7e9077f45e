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


class RoundTrips:
    """Questions to the router and when they were asked: bounds the age of what comes without a number.

    All comes in the order in which the router has sent it: what comes behind an answer was sent after the question.
    """

    def __init__(self):
        self.asked = -math.inf  # [s] the newest question that was answered
        self.took = math.inf    # [s] until that answer

    def answered(self, asked, now):
        """The answer to a question of the time `asked` came at time `now` [s]."""
        self.asked, self.took = asked, now - asked

    def age(self, now):
        """How old [s] what comes from the router at time `now` can be at most, since it has left the router."""
        return now - self.asked
