"""Detects that a process was stopped or starved, and how old messages may be that it handles only now.

Messages that waited in the sockets of a stopped process look new to it when it goes on.
"""

import math

LONGEST = 1.0  # [s] for which messages count as old after a gap, however long that was


class StallWatch:
    """Finds gaps longer than `gap` [s] between calls. Times [s] are the caller's, from a clock that never goes back.

    A busy computer may let the process wait again before it has emptied its queues. So messages count as old, as of the
    beginning of a gap, for as long after it as it lasted, at least for `gap`, which is the shortest that is noticed,
    and for LONGEST at most; a gap that begins meanwhile continues the first.
    """

    def __init__(self, gap, now):
        self._gap = gap
        self._ticked = now
        self._began = None         # the newest gap
        self._settled = -math.inf  # from when on messages are new again
        self.stalls = 0

    def tick(self, now):
        """Note that the process is alive; call it much more often than every `gap`."""
        waited = now - self._ticked
        if waited > self._gap:
            if self._ticked >= self._settled:
                self._began = self._ticked
            self._settled = now + min(max(self._gap, waited), LONGEST)
            self.stalls += 1
        self._ticked = max(self._ticked, now)  # a thread may have read the clock before the gap

    def earliest_arrival(self, now):
        """[s] when a message that is handled `now` may have arrived at the earliest."""
        self.tick(now)
        return self._began if now < self._settled else now
