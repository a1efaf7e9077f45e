"""Rounds speeds to the decimals of a packet without losing distance: what one packet lacks, the next ones contain.

A rounding error, times the time for which its packet was the newest, is a path: 0.004 units on each wheel of a robot
that turns are 0.2 degrees in a circle. It is made good by values that are rounded the other way (error feedback).
"""

ZERO = 1e-9  # values below this stand for a wheel at rest, after floating-point arithmetic


class CarriedRounding:
    """Rounds n values to `decimals`. hold: [s] for which a value usually stays the newest one.

    Times [s] are the caller's, of a clock that never goes back. A value is off by at most one step of the last decimal,
    the sum over time by half of one. Zero is sent as zero and ends what was carried: a wheel that is to stand stands.
    """

    def __init__(self, amount, decimals, hold):
        self._decimals = decimals
        self._hold = hold
        self._carried = [0.0] * amount  # [value * s] by which the sum over time is too small
        self._errors = [0.0] * amount   # wanted minus sent, of the newest values
        self._since = 0.0               # [s] when they were sent

    def round(self, values, now):
        """The list of n floats to send at time `now` for `values` (n floats)."""
        elapsed = min(now - self._since, self._hold)  # after a gap a wheel need not catch up any further
        self._since = now
        carried, errors, sent = self._carried, self._errors, []
        for wheel, value in enumerate(values):
            if -ZERO < value < ZERO:
                carried[wheel] = errors[wheel] = rounded = 0.0
            else:
                carried[wheel] += errors[wheel] * elapsed
                # "+ 0.0" makes a negative zero positive
                rounded = round(value + carried[wheel] / self._hold, self._decimals) + 0.0
                errors[wheel] = value - rounded
            sent.append(rounded)
        return sent
