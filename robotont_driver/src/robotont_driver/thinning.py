"""Fewer messages for those who need fewer, evenly."""

SECOND = 1_000_000_000  # [ns]


class Thinning:
    """Passes at most one message in each period of a `rate` [Hz], the first one; all where the rate is 0."""

    def __init__(self, rate):
        self._period = round(SECOND / rate) if rate else 0  # [ns]
        self._newest = None  # number of the period of the newest message that was passed

    def passes(self, stamp):
        """Whether to pass the message of a stamp [ns]. The clock may go back."""
        if not self._period:
            return True
        number = stamp // self._period
        if number == self._newest:
            return False
        self._newest = number
        return True
