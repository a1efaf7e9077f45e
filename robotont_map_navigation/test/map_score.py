"""How far the walls of a map lie from the true faces of a world, after the best rigid alignment."""

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from robotont_driver.kinematics.se2 import compose
from robotont_simulator.world import OCCUPIED, draw_map

FINE = 0.02         # [m] of the true faces
WITHIN = 0.10       # [m] up to which a wall counts as found
FAR = 0.3           # [m] from which an error does not pull at the alignment any more


def score(points, world, start):
    """Figures of a map's occupied cells, n x 2 [m] of their middles in the map's frame.

    Nine of ten cells lie within p90_m of a face that a robot sees which goes wherever it can; recall: share of such
    faces that are found. start: (x, y, yaw) of the map's frame in the world, about.
    """
    image, corner = draw_map(world, FINE)
    faces = np.argwhere(image[::-1] == OCCUPIED)[:, ::-1] * FINE + corner + FINE / 2
    nearest = cKDTree(faces)

    def moved(pose):
        return np.transpose(compose(pose, (*points.T, 0.0))[:2])

    def distances(pose):
        return nearest.query(moved(pose))[0]
    around = start + np.vstack([np.zeros(3), np.diag([0.1, 0.1, 0.05])])
    pose = minimize(lambda placed: np.minimum(distances(placed), FAR).mean(), start, method="Nelder-Mead",
                    options={"initial_simplex": around, "xatol": 1e-3}).x
    found = cKDTree(moved(pose)).query(faces)[0] <= WITHIN
    return {"p90_m": round(float(np.percentile(distances(pose), 90)), 3), "recall": round(float(np.mean(found)), 2)}
