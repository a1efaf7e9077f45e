"""Which refused messages get a line in the log: changes only, for a faulty sender repeats itself at its full rate."""

QUIET = 10.0  # [s] without refusals, after which the next one is news again
PAUSE = 1.0   # [s] between two lines at least


class Refusals:
    """Counts refused messages. Times [s] are the caller's, from a clock that never goes back."""

    def __init__(self):
        self.amount = 0
        self._kind = None       # of the newest line in the log
        self._refused_at = self._logged_at = float("-inf")

    def refuse(self, kind, now):
        """Count a message, refused for a reason of that kind; returns whether to log it."""
        self.amount += 1
        quiet = now - self._refused_at > QUIET
        self._refused_at = now
        news = (quiet or kind != self._kind) and now - self._logged_at >= PAUSE
        if news:
            self._kind, self._logged_at = kind, now
        return news
