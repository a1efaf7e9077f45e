"""Detects that a process was stopped or starved, and how old messages may be that it handles only now.

A stopped process (SIGSTOP, a computer that swaps) does not notice that time passes. The messages that waited for it
in its sockets look new when it goes on. This watch notices the gap between two of its ticks, and from then on, until
the queues must be empty, gives the beginning of the gap as the time at which messages may have arrived.
"""


class StallWatch:
    """Finds gaps longer than `gap` [s] between calls. Times [s] are the caller's, from a clock that never goes back.

    A busy computer may let the process wait again before it has emptied its queues. Waits shorter than `gap` are not
    noticed, so messages count as old for that long after a gap; one that begins meanwhile continues the first.
    """

    def __init__(self, gap, now):
        self._gap = gap
        self._ticked = now
        self._began = self._ended = None  # of the newest gap
        self.stalls = 0

    def tick(self, now):
        """Note that the process is alive; call it much more often than every `gap`."""
        if now - self._ticked > self._gap:
            if not self._settling(self._ticked):
                self._began = self._ticked
            self._ended = now
            self.stalls += 1
        self._ticked = now

    def earliest_arrival(self, now):
        """[s] when a message that is handled `now` may have arrived at the earliest."""
        self.tick(now)
        return self._began if self._settling(now) else now

    def _settling(self, now):
        return self._ended is not None and now - self._ended < self._gap
