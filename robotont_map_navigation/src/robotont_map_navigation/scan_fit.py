"""How well what a robot sees fits the map; without ROS."""

import itertools
from typing import NamedTuple

import numpy as np

from robotont_driver.kinematics.se2 import compose

FEWEST_RAYS = 10  # fewer prove nothing
MOST_RAYS = 60    # that are compared with the map
NEARLY = 0.1      # [m], [rad] off along each axis, amcl finds the pose by itself
GOOD = 0.9        # worth from which on no pose beside it is looked at


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


def around(pose, step, turn):
    """A pose and the 26 beside it, `step` [m] and `turn` [rad] off."""
    return [tuple(np.add(pose, off)) for off in itertools.product((0.0, -step, step), (0.0, -step, step),
                                                                  (0.0, -turn, turn))]


def fit_nearby(floor_map, pose, rays, tolerance):
    """The best `fit` at a pose or NEARLY there; None when too few rays show anything."""
    count = sum(each.shape[1] for each in rays)
    if count < FEWEST_RAYS:
        return None
    rays, best = [each[:, ::1 + count // MOST_RAYS] for each in rays], Fit(0.0, 1.0)
    for place in around(pose, NEARLY, NEARLY):
        best = max(best, fit(floor_map, place, rays, tolerance, tolerance), key=lambda one: one.worth)
        if best.worth > GOOD:
            break
    return best
