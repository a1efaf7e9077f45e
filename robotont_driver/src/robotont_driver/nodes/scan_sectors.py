"""Three sectors of a laser scan, as the course exercises with Robotont use them."""

import math


def sectors(ranges, nearest, farthest):
    """((minimum, mean) [m] of the right, the centre and the left third) of a scan from right to left.

    Too near (-inf, or below `nearest`) counts as `nearest`, nothing seen (inf, or beyond) as `farthest` [m]; NaN does
    not count. A third without any number is `farthest`.
    """
    third = len(ranges) / 3
    bounds = [round(third * part) for part in range(4)]
    return tuple(_sector(ranges[begin:end], nearest, farthest) for begin, end in zip(bounds, bounds[1:]))


def _sector(ranges, nearest, farthest):
    seen = [min(max(distance, nearest), farthest) for distance in ranges if not math.isnan(distance)]
    return (min(seen), sum(seen) / len(seen)) if seen else (farthest, farthest)
