"""How uncertain counts are: two independent errors, whose constants stand here once."""

import numpy as np

# [edges^2] Variance of the quantisation error of one encoder reading: uniform over one edge. Counts are differences
# of readings, so the errors cancel from packet to packet: of a path, however long, two readings' errors remain.
READING_VARIANCE = 1.0 / 12.0
PATH_VARIANCE = 2 * READING_VARIANCE


def variance_per_edge(wheel_noise, metres_per_edge):
    """[edges^2 per edge], n: by how much each edge adds to the variance of a wheel's path.

    wheel_noise: standard deviation [m] of a wheel's path after 1 m, growing with the square root of the path.
    metres_per_edge: n [m].
    """
    return wheel_noise ** 2 / np.asarray(metres_per_edge)
