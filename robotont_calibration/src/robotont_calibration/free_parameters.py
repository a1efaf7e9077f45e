"""Which of a robot's numbers a calibration looks for, and how they stand in its wheel parameters."""

import numpy as np

# How far off a parameter may be before the runs: standard deviations of the loose tie to its old value.
RADIUS_TIE = 0.1     # part of the radius
DISTANCE_TIE = 0.1   # part of the distance
ANGLE_TIE = 0.2      # [rad]
POINT_TIE = 0.3      # [m]


class FreeParameters:
    """Which numbers are looked for, as small numbers that are 0 for the old values.

    given: mapping with the keys of wheel_params.yaml. radius: "common" (one factor for all) or "each". angles: "each"
    or "fixed". point: "free", or (x, y) [m] in base_link of what the measured poses are of.
    """

    def __init__(self, given, radius="common", angles="each", point=(0.0, 0.0)):
        amount = given["wheelAmount"]
        self._given = given
        self._radii = {"common": 1, "each": amount}[radius]
        angles = {"each": amount, "fixed": 0}[angles]
        self._point = None if point == "free" else tuple(point)
        points = 2 if self._point is None else 0
        self.names = [
            *(["wheelRadius"] if self._radii == 1 else [f"wheelRadius[{wheel}]" for wheel in range(amount)]),
            "wheelDistanceFromCenter", *(f"wheelRads[{wheel}]" for wheel in range(angles)),
            *("point x", "point y")[:points],
        ]
        self.ties = np.array([RADIUS_TIE] * self._radii + [DISTANCE_TIE] + [ANGLE_TIE] * angles + [POINT_TIE] * points)

    def parameters(self, values):
        """The mapping with these `values`: parts by which radii and distance are larger, [rad] added to angles."""
        given = dict(self._given)
        radii, distance, rest = np.split(np.asarray(values), (self._radii, self._radii + 1))
        given["wheelRadius"] = _scaled(given["wheelRadius"], 1 + radii)
        given["wheelDistanceFromCenter"] = _scaled(given["wheelDistanceFromCenter"], 1 + distance)
        if "wheelRads[0]" in self.names:
            given["wheelRads"] = [float(rad + added) for rad, added in zip(given["wheelRads"], rest)]
        return given

    def point(self, values):
        """(x, y) [m] of the measured point in base_link."""
        return self._point or (float(values[-2]), float(values[-1]))


def _scaled(value, factors):
    """A number or list times factors, one or one per wheel; a number stays one where it can."""
    scaled = np.asarray(value, dtype=float) * factors
    return scaled.tolist() if isinstance(value, (list, tuple)) or len(factors) > 1 else float(scaled[0])
