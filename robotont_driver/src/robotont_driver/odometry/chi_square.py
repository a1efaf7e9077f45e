"""Limits of the chi-square distribution."""

import math


def chi_square_tail(value, degrees):
    """Probability that a chi-square variable of `degrees` (a whole number > 0) of freedom exceeds `value`.

    The upper incomplete gamma function of a half-integer, a finite sum. scipy.special would cost odom_node 14 MB.
    """
    half = value / 2
    tail = math.erfc(math.sqrt(half)) if degrees % 2 else 0.0
    power = 0.5 if degrees % 2 else 0.0
    while power < degrees / 2:
        tail += math.exp(-half) * half ** power / math.gamma(power + 1)
        power += 1
    # the odd sum runs over 1/2, 3/2, ... below degrees / 2; the even one over 0, 1, ...
    return tail


def chi_square_limit(rate, degrees):
    """The value that a chi-square variable of `degrees` of freedom exceeds with probability `rate` (0 to 1)."""
    low, high = 0.0, 10.0
    while chi_square_tail(high, degrees) > rate and high < 1e3:
        high *= 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if chi_square_tail(middle, degrees) > rate else (low, middle)
    return high
