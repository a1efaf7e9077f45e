"""How far the walls of a map lie from the true faces of a world, after the best rigid alignment."""

import math

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.optimize import minimize

from robotont_simulator.world import OCCUPIED, draw_map

FINE = 0.02         # [m] of the true faces
MARGIN = 1.0        # [m] around the world; farther off all is equally wrong
WITHIN = 0.10       # [m] up to which a wall counts as found
FAR = 0.3           # [m] from which an error does not pull at the alignment any more


class Faces:
    """The faces of a World that a robot sees which goes wherever it can from the start."""

    def __init__(self, world):
        image, self._origin = draw_map(world, FINE, MARGIN)
        wall = image[::-1] == OCCUPIED
        self._distances = distance_transform_edt(~wall) * FINE
        self.points = np.argwhere(wall)[:, ::-1] * FINE + self._origin + FINE / 2  # n x 2 [m]

    def distances(self, points):
        """[m] of points, n x 2 [m], from the nearest face."""
        cells = np.floor((points - self._origin) / FINE).astype(int)
        inside = np.clip(cells, 0, np.array(self._distances.shape)[::-1] - 1)
        return self._distances[inside[:, 1], inside[:, 0]] + np.hypot(*(cells - inside).T) * FINE


def moved(points, pose):
    """Points, n x 2, of a frame that lies at `pose` (x [m], y [m], yaw [rad])."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    return points @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]


def aligned(points, faces, pose):
    """The pose near `pose` of the map's frame in the world at which `points` lie nearest to the faces."""
    def cost(placed):
        return np.minimum(faces.distances(moved(points, placed)), FAR).mean()
    around = pose + np.vstack([np.zeros(3), np.diag([0.1, 0.1, 0.05])])
    return minimize(cost, pose, method="Nelder-Mead", options={"initial_simplex": around, "xatol": 1e-3}).x


def score(points, world, start=None):
    """Figures of a map's occupied cells, n x 2 [m] of their middles in the map's frame.

    start: (x, y, yaw) of the map's frame in the world, about; None: the world's start.
    """
    faces = Faces(world)
    pose = aligned(points, faces, np.array(world.start if start is None else start, float))
    points = moved(points, pose)
    distances = faces.distances(points)
    found = [np.hypot(*(points - face).T).min() <= WITHIN for face in faces.points[::5]]
    return {
        "cells": len(points), "p50_m": round(float(np.median(distances)), 3),
        "p90_m": round(float(np.percentile(distances, 90)), 3),
        "precision": round(float(np.mean(distances <= WITHIN)), 2), "recall": round(float(np.mean(found)), 2),
        "moved": [round(float(each), 3) for each in pose],
    }
