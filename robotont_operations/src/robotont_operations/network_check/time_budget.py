"""The time that all checks together may take."""

import time

BUDGET = 4.0      # [s] that all checks together may take
WORTHWHILE = 0.5  # [s] that a probe needs at least: what has less is not begun, and reported as not checked


class TimeBudget:
    """Time that the checks share; it runs from the start, and ends at `end`, a time of time.monotonic()."""

    def __init__(self):
        self.end = time.monotonic() + BUDGET

    def left(self, most=BUDGET):
        """Time [s] that a probe may take: what is left, at most `most`; never quite nothing."""
        return max(0.05, min(most, self.end - time.monotonic()))

    def is_spent(self):
        """Whether what is left is not worth the beginning of a probe."""
        return self.left() < WORTHWHILE
