"""Detects that a process was stopped or starved, and how old messages may be that it handles only now.

A stopped process (SIGSTOP, a computer that swaps) does not notice that time passes. The messages that waited for it
in its sockets look new when it goes on. This watch notices the gap between two of its ticks, and from then on, until
the queues must be empty, gives the beginning of the gap as the time at which messages may have arrived.
"""

import math

LONGEST = 1.0  # [s] for which messages count as old after a gap, however long that was


class StallWatch:
    """Finds gaps longer than `gap` [s] between calls. Times [s] are the caller's, from a clock that never goes back.

    A busy computer may let the process wait again before it has emptied its queues, or let only some of its threads
    go on. So messages count as old for as long after a gap as it lasted, at least for `gap`, because shorter waits are
    not noticed, and for LONGEST at most; a gap that begins meanwhile continues the first.
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
