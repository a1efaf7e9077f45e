"""Drives a robot along a route as docs/first-map.md tells a person to, from one pose to the next."""

import math

SPEED = 0.2      # [m/s]
TURN = 0.5       # [rad/s]
ARRIVED = 0.05   # [m] from a place
FACING = 0.05    # [rad]
REST = 4.0       # [s] of standing at the start and at each new place, in which a gyro's bias is learnt

# Places (x, y) [m] that the robot visits one after the other; it looks around at each, to either side.
ROUTES = {
    "mapping_flat": ((0.8, 0.8), (2.4, 0.7), (2.4, 1.9), (3.8, 1.9), (3.7, 3.0), (3.6, 5.2), (1.8, 5.2), (0.8, 4.0),
                     (2.2, 3.2), (3.7, 2.65), (5.1, 2.65), (5.1, 0.7), (5.1, 3.9), (5.2, 5.3), (6.4, 5.0), (7.0, 3.2),
                     (6.8, 0.9), (6.6, 3.0), (6.3, 5.1), (5.1, 5.2), (5.1, 2.65), (3.7, 2.65), (2.3, 2.9), (0.8, 2.6),
                     (0.8, 0.8)),
    "mapping_ring": ((0.8, 0.8), (2.4, 0.7), (3.4, 0.7), (3.45, 2.4), (4.6, 2.5), (4.3, 3.9), (3.3, 3.0), (2.5, 2.5),
                     (3.45, 2.2), (3.45, 0.7), (5.6, 0.9), (6.4, 2.2), (6.4, 3.8), (6.2, 5.3), (4.6, 5.5), (2.8, 5.4),
                     (1.0, 5.6), (0.9, 4.3), (1.0, 2.4), (0.8, 0.8), (2.4, 0.7), (3.4, 0.7)),
}


def drive(places, rate):
    """A generator of `rate` twists (v_x [m/s], v_y, omega [rad/s]) per second; send it the true (x, y, yaw) each time.

    At each new place the robot stands for a while, then turns on the spot, all the way round: to the left at the first,
    to the right at the second, and so on.
    """
    pose = yield (0.0, 0.0, 0.0)
    seen = []
    for place in places:
        while math.dist(pose[:2], place) > ARRIVED:
            bearing = math.atan2(place[1] - pose[1], place[0] - pose[0])
            off = math.remainder(bearing - pose[2], 2 * math.pi)
            if abs(off) > 0.3:
                while abs(off) > FACING:
                    pose = yield (0.0, 0.0, _limited(2.0 * off, TURN))
                    off = math.remainder(bearing - pose[2], 2 * math.pi)
            pose = yield (min(SPEED, 0.05 + math.dist(pose[:2], place)), 0.0, _limited(1.5 * off, TURN))
        if place not in seen:
            seen.append(place)
            for _ in range(round(REST * rate)):
                pose = yield (0.0, 0.0, 0.0)
            side, turned = 1.0 if len(seen) % 2 else -1.0, 0.0
            while turned < 2 * math.pi:
                before = pose[2]
                pose = yield (0.0, 0.0, side * min(TURN, 0.1 + 2 * math.pi - turned))
                turned += side * math.remainder(pose[2] - before, 2 * math.pi)
    yield (0.0, 0.0, 0.0)


def _limited(value, most):
    return max(-most, min(most, value))
