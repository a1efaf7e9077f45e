"""How well what a robot sees fits the map, where it is believed to be or anywhere; without ROS."""

import itertools
import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # fewer prove nothing
MOST_RAYS = 60    # that are compared with the map
NEARLY = 0.1      # [m], [rad] off along each axis, amcl finds the pose by itself
GOOD = 0.9        # worth from which on no pose beside it is looked at

# of a search everywhere
COARSE = 0.15, math.radians(6.0)  # [m], [rad] between two places that are tried first
NEAR = 0.15                       # [m] from a wall at which a ray then ends at it
FINE = 0.05, math.radians(2.0)    # [m], [rad] of the steps around the best of them
FINE_NEAR = 0.07                  # [m]
CANDIDATES = 30                   # that are looked at finely, no two of them ...
APART = 0.5, 0.5                  # ... as close as this [m], [rad]
RAYS = 80                         # that are compared
BETTER = 0.15                     # by which another place has to explain more than the one that is believed


class Fit(NamedTuple):
    """Shares, 0 to 1, of rays."""

    explained: float      # that end at a wall of the map, or see nothing where it has nothing
    through_walls: float  # that go on behind one: no obstacle explains them, a wrong pose or a changed room does

    @property
    def worth(self):
        """What speaks for the pose less what speaks against it, -1 to 1."""
        return self.explained - self.through_walls


def fit(floor_map, pose, rays, near, behind):
    """`Fit` of rays and a FloorMap at a pose (x [m], y [m], yaw [rad]).

    rays: (ends 2 x N, free 2 x M) [m], seen from the pose: where they ended, and how far those saw that met nothing.
    near, behind: [m] before and behind a wall at which a ray still ends at it.
    """
    x, y, _ = compose(pose, (*np.hstack(rays), 0.0))
    through = floor_map.are_behind_walls(pose[:2], (x, y), behind)
    ended = np.arange(len(x)) < rays[0].shape[1]
    explained = np.where(ended, floor_map.are_near_walls((x, y), near), ~through)
    return Fit(float(explained.mean()), float(through.mean()))


def _around(pose, step, turn):
    """A pose and the 26 beside it, `step` [m] and `turn` [rad] off."""
    return [tuple(np.add(pose, off)) for off in itertools.product((0.0, -step, step), (0.0, -step, step),
                                                                  (0.0, -turn, turn))]


def fit_nearby(floor_map, pose, rays, tolerance):
    """The best `fit` at a pose or NEARLY there; None when too few rays show anything.

    One that ends where the map knows nothing, behind no wall and at none, proves nothing.
    """
    count = sum(each.shape[1] for each in rays)
    ends, free = (each[:, ::1 + count // MOST_RAYS] for each in rays)
    places = compose(pose, (*ends, 0.0))[:2]
    nothing = floor_map.are_unknown(places) & ~floor_map.are_near_walls(places, tolerance)
    if nothing.any():
        nothing &= ~floor_map.are_behind_walls(pose[:2], places, tolerance)
    rays, best = (ends[:, ~nothing], free), Fit(0.0, 1.0)
    if sum(each.shape[1] for each in rays) < FEWEST_RAYS:
        return None
    for place in _around(pose, NEARLY, NEARLY):
        best = max(best, fit(floor_map, place, rays, tolerance, tolerance), key=lambda one: one.worth)
        if best.worth > GOOD:
            break
    return best


class Found(NamedTuple):
    """A place that fits."""

    pose: Tuple[float, float, float]  # x [m], y [m], yaw [rad]
    share: float                      # of the rays that the map explains there, less those through walls


def search(floor_map, rays, clearance, believed=None):
    """The places that fit best, a list of `Found`, the best first, none close to another.

    rays: (ends, free) as of `fit`, in the robot's frame; clearance: [m] that the robot is off walls at least.
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


def same_place(one, other):
    """Whether two poses (x [m], y [m], yaw [rad]) are not APART."""
    return (math.dist(one[:2], other[:2]) <= APART[0]
            and abs(math.remainder(one[2] - other[2], 2 * math.pi)) <= APART[1])


def _apart(places):
    """Those of many `Found` that are not at the place of one before them."""
    kept = []
    for place in places:
        if not any(same_place(place.pose, other.pose) for other in kept):
            kept.append(place)
            yield place


def _refined(floor_map, pose, rays):
    """`Found`: the best around a pose, by smaller and smaller steps."""
    best, (step, turn) = Found(pose, -1.0), FINE
    while step > 0.02:
        better = max((Found(place, fit(floor_map, place, rays, FINE_NEAR, 2 * FINE_NEAR).worth)
                      for place in _around(best.pose, step, turn)), key=lambda one: one.share)
        if better.share > best.share:
            best = better
        else:
            step, turn = step / 2, turn / 2
    return best
