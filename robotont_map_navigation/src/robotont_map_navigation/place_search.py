"""Where on a map a robot is that has looked all around: every place and direction is tried; without ROS."""

import itertools
import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics.se2 import compose
from robotont_map_navigation.scan_fit import fit

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


def search(floor_map, ends, free, clearance, believed=None):
    """The places that fit best, a list of `Found`, the best first, none close to another.

    believed: (x, y, yaw) where the robot may be already; that place is the first one, unless another explains BETTER
    more: a cupboard that has gone makes some other place fit a little better than the right one.

    ends: where rays have ended, 2 x N [m] in the robot's frame; free: as far as rays saw that ended nowhere, 2 x M;
    clearance: [m] that the robot is off all walls at least.
    """
    ends, free = (rays[:, ::1 + rays.shape[1] // RAYS] for rays in (ends, free))
    step, turn = COARSE
    along, across = (np.arange(step / 2, side, step) for side in floor_map.size)
    x, y, _ = compose(floor_map.origin, (*np.reshape(np.meshgrid(along, across), (2, -1)), 0.0))
    possible = ~floor_map.are_near_walls((x, y), clearance)
    x, y, yaws = x[possible], y[possible], np.arange(-math.pi, math.pi, turn)
    shares = np.array([_share_at_walls(floor_map, x, y, yaw, ends) for yaw in yaws])
    candidates = [believed] if believed else []
    for number in np.argsort(shares, axis=None)[::-1]:
        at_yaw, place = np.unravel_index(number, shares.shape)
        pose = x[place], y[place], yaws[at_yaw]
        if not any(near(pose, other) for other in candidates):
            candidates.append(pose)
            if len(candidates) >= CANDIDATES:
                break
    refined = [_refined(floor_map, pose, ends, free) for pose in candidates]
    first = refined[0] if believed else None
    found = []
    for better in sorted(refined, key=lambda one: -one.share - (BETTER if one is first else 0.0)):
        if not any(near(better.pose, other.pose) for other in found):
            found.append(better)
    return found


def near(one, other):
    """Whether two poses (x, y, yaw) are the same place."""
    return (math.dist(one[:2], other[:2]) <= APART[0]
            and abs(math.remainder(one[2] - other[2], 2 * math.pi)) <= APART[1])


def _share_at_walls(floor_map, x, y, yaw, ends):
    """Share of the ends at walls for each of the places x, y (N each) [m]."""
    dx, dy, _ = compose((0.0, 0.0, yaw), (*ends, 0.0))
    near = floor_map.are_near_walls(((x[:, None] + dx).ravel(), (y[:, None] + dy).ravel()), NEAR)
    return near.reshape(len(x), -1).mean(axis=1)


def _refined(floor_map, pose, ends, free):
    """`Found`: the best around a pose, by smaller and smaller steps."""
    def look(pose):
        return Found(pose, fit(floor_map, pose, ends, free, FINE_NEAR, 2 * FINE_NEAR).worth)
    best, (step, turn) = look(pose), FINE
    while step > 0.02:
        x, y, yaw = best.pose
        better = max((look((x + dx * step, y + dy * step, yaw + da * turn))
                      for dx, dy, da in itertools.product((-1, 0, 1), repeat=3)), key=lambda one: one.share)
        if better.share > best.share:
            best = better
        else:
            step, turn = step / 2, turn / 2
    return best
