"""How well what a robot sees fits the map; without ROS."""

import itertools
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # fewer prove nothing
MOST_RAYS = 60    # that are compared with the map
NEARLY = tuple(itertools.product((0.0, -0.1, 0.1), repeat=3))  # [m], [m], [rad] off, amcl finds the pose by itself
GOOD = 0.9        # worth from which on no pose beside it is looked at


class Fit(NamedTuple):
    """Shares, 0 to 1, of rays."""

    explained: float      # that end at a wall of the map, or see nothing where it has nothing
    through_walls: float  # that go on behind one: no obstacle explains them, a wrong pose or a changed room does

    @property
    def worth(self):
        """What speaks for the pose less what speaks against it, -1 to 1."""
        return self.explained - self.through_walls


def fit(floor_map, pose, ends, free, near, behind):
    """`Fit` of rays and a FloorMap at a pose (x [m], y [m], yaw [rad]).

    ends, free: 2 x N and 2 x M [m], seen from the pose: where rays have ended, and how far those saw that met nothing.
    near, behind: [m] before and behind a wall at which a ray still ends at it.
    """
    x, y, _ = compose(pose, (*np.hstack([ends, free]), 0.0))
    through = floor_map.are_behind_walls(pose[:2], (x, y), behind)
    ended = np.arange(len(x)) < ends.shape[1]
    explained = np.where(ended, floor_map.are_near_walls((x, y), near), ~through)
    return Fit(float(explained.mean()), float(through.mean()))


def fit_nearby(floor_map, pose, ends, free, tolerance):
    """The best `fit` at a pose or NEARLY there; None when too few rays show anything."""
    count = ends.shape[1] + free.shape[1]
    if count < FEWEST_RAYS:
        return None
    ends, free = (rays[:, ::1 + count // MOST_RAYS] for rays in (ends, free))
    best = Fit(0.0, 1.0)
    for off in NEARLY:
        best = max(best, fit(floor_map, tuple(np.add(pose, off)), ends, free, tolerance, tolerance),
                   key=lambda one: one.worth)
        if best.worth > GOOD:
            break
    return best
