"""Detects that a process was stopped or starved, and how old messages may be that it handles only now.

A stopped process (SIGSTOP, a computer that swaps) does not notice that time passes. The messages that waited for it
in its sockets look new when it goes on. This watch notices the gap between two of its ticks, and from then on, until
the queues are empty, gives the beginning of the gap as the time at which messages may have arrived.
"""

SETTLING = 0.1  # [s] after a gap in which messages that waited are handled


class StallWatch:
    """Finds gaps longer than `gap` [s] between calls. Times [s] are the caller's, from a clock that never goes back."""

    def __init__(self, gap, now):
        self._gap = gap
        self._ticked = now
        self._began = self._ended = None  # of the newest gap
        self.stalls = 0

    def tick(self, now):
        """Note that the process is alive; call it much more often than every `gap`."""
        if now - self._ticked > self._gap:
            self._began, self._ended = self._ticked, now
            self.stalls += 1
        self._ticked = now

    def earliest_arrival(self, now):
        """[s] when a message that is handled `now` may have arrived at the earliest."""
        self.tick(now)
        settling = self._ended is not None and now - self._ended < SETTLING
        return self._began if settling else now
