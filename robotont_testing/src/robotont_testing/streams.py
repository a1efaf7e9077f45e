"""What was sent through a system under test against what came out: delays, losses, repetitions. Pure."""

from array import array
from collections import deque


class Stream:
    """Matches arrivals to sendings by their tags, in order.

    Consecutive sendings must have different tags; a tag may come again later, so that losses are counted exactly as
    long as fewer than one cycle of tags is lost in a row.
    """

    def __init__(self):
        self.delays = array("f")  # [s] of each sending that arrived
        self.sent = 0         # sendings
        self.repeated = 0    # arrivals of a tag that had just arrived
        self.unexpected = 0  # arrivals that nothing under way explains: invented, or out of order
        self.overtaken = 0   # sendings that did not arrive before a later one did
        self._newest = None  # tag of the newest arrival
        self._waiting = deque()  # (time, tag) of what is under way

    def send(self, time, tag):
        """Something with this tag was sent at `time` [s]."""
        self.sent += 1
        self._waiting.append((time, tag))

    def arrived(self, time, tag):
        """Something with this tag arrived at `time` [s]."""
        place = next((index for index, (_, waiting) in enumerate(self._waiting) if waiting == tag), None)
        if tag == self._newest:
            self.repeated += 1
        elif place is None:
            self.unexpected += 1
        else:
            for _ in range(place):
                self._waiting.popleft()
            self.overtaken += place
            self._newest = tag
            self.delays.append(time - self._waiting.popleft()[0])

    @property
    def under_way(self):
        """Sendings that neither arrived nor were overtaken."""
        return len(self._waiting)

    @property
    def lost(self):
        """Sendings that did not arrive; right once nothing more can come."""
        return self.overtaken + len(self._waiting)
