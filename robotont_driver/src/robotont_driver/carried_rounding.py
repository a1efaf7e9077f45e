"""Rounds speeds to the decimals of a packet without losing distance: what one packet lacks, the next ones contain.

Each packet is held until the next one, so a rounding error grows into a path: 0.004 units on each wheel of a robot that
turns are 0.2 degrees in a circle. Here the error of each value, times the time for which it was held, is carried on and
made good by values that are rounded the other way (error feedback). The sum over time stays exact to half a step of
one packet.
"""

ZERO = 1e-9  # values below this stand for a wheel at rest, after floating-point arithmetic


class CarriedRounding:
    """Rounds n `values` to `decimals`. hold: [s] for which a value usually stays the newest one.

    Times [s] are the caller's, from a clock that never goes back. A value is at most one step of the last decimal and
    a half from what was wanted. A value of zero is sent as zero and ends what was carried: a wheel that is to stand
    stands.
    """

    def __init__(self, amount, decimals, hold):
        self._decimals = decimals
        self._hold = hold
        self._most = hold / 10 ** decimals  # that is carried: after a gap a wheel need not catch up any further
        self._carried = [0.0] * amount      # [value * s]
        self._errors = [0.0] * amount       # wanted minus sent, of the newest values
        self._since = 0.0                   # [s] when they were sent

    def round(self, values, now):
        """The list of n floats to send at time `now` for `values` (n floats)."""
        elapsed, self._since = now - self._since, now
        sent = []
        for index, value in enumerate(values):
            if abs(value) < ZERO:
                self._carried[index] = self._errors[index] = 0.0
                sent.append(0.0)
                continue
            carried = self._carried[index] + self._errors[index] * elapsed
            self._carried[index] = carried = max(-self._most, min(carried, self._most))
            rounded = round(value + carried / self._hold, self._decimals) + 0.0  # which makes a negative zero positive
            self._errors[index] = value - rounded
            sent.append(rounded)
        return sent
