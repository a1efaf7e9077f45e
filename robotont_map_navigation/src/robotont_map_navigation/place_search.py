"""Where on a map a robot is that has looked all around: every place and direction is tried; without ROS."""

import itertools
import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.scan_fit import around, fit

COARSE = 0.15, math.radians(6.0)  # [m], [rad] between two places that are tried first
NEAR = 0.15                       # [m] from a wall at which a ray then ends at it
FINE = 0.05, math.radians(2.0)    # [m], [rad] of the steps around the best of them
FINE_NEAR = 0.07                  # [m]
CANDIDATES = 30                   # that are looked at finely, no two of them ...
APART = 0.5, 0.5                  # ... as close as this [m], [rad]
RAYS = 80                         # that are compared
BETTER = 0.15                     # by which another place has to explain more than the one that is believed


class Found(NamedTuple):
    """A place that fits."""

    pose: Tuple[float, float, float]  # x [m], y [m], yaw [rad]
    share: float                      # of the rays that the map explains there, less those through walls


def search(floor_map, rays, clearance, believed=None):
    """The places that fit best, a list of `Found`, the best first, none close to another.

    rays: (ends, free) as of scan_fit.fit, in the robot's frame; clearance: [m] that the robot is off walls at least.
    believed: (x, y, yaw) where the robot may be already; that place is the first one, unless another explains BETTER
    more: a cupboard that has gone makes some other place fit a little better than the right one.
    """
    rays = [each[:, ::1 + each.shape[1] // RAYS] for each in rays]
    step, turn = COARSE
    along, across = (np.arange(step / 2, side, step) for side in floor_map.size)
    x, y, _ = compose(floor_map.origin, (*np.reshape(np.meshgrid(along, across), (2, -1)), 0.0))
    possible = ~floor_map.are_near_walls((x, y), clearance)
    x, y, yaws = x[possible], y[possible], np.arange(-math.pi, math.pi, turn)
    ends = [compose((0.0, 0.0, yaw), (*rays[0], 0.0)) for yaw in yaws]
    shares = np.array([floor_map.are_near_walls((x[:, None] + dx, y[:, None] + dy), NEAR).mean(axis=1)
                       for dx, dy, _ in ends])
    best_first = np.transpose(np.unravel_index(np.argsort(shares, axis=None)[::-1], shares.shape))
    coarse = (Found((x[place], y[place], yaws[at_yaw]), shares[at_yaw, place]) for at_yaw, place in best_first)
    refined = [_refined(floor_map, one.pose, rays) for one in itertools.islice(_apart(coarse), CANDIDATES)]
    kept = [_refined(floor_map, believed, rays)] if believed else []
    ranked = sorted([*kept, *refined], key=lambda one: one.share + BETTER * (one in kept), reverse=True)
    return list(_apart(ranked))


def near(one, other):
    """Whether two poses (x, y, yaw) are the same place."""
    return (math.dist(one[:2], other[:2]) <= APART[0]
            and abs(math.remainder(one[2] - other[2], 2 * math.pi)) <= APART[1])


def _apart(places):
    """Those of many `Found` that are not near one before them."""
    kept = []
    for place in places:
        if not any(near(place.pose, other.pose) for other in kept):
            kept.append(place)
            yield place


def _refined(floor_map, pose, rays):
    """`Found`: the best around a pose, by smaller and smaller steps."""
    best, (step, turn) = Found(pose, -1.0), FINE
    while step > 0.02:
        better = max((Found(place, fit(floor_map, place, rays, FINE_NEAR, 2 * FINE_NEAR).worth)
                      for place in around(best.pose, step, turn)), key=lambda one: one.share)
        if better.share > best.share:
            best = better
        else:
            step, turn = step / 2, turn / 2
    return best
