"""The wheels and the drive train: the thesis' seven keys (Figure 4, Table 1) and two of our own."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.parameters import ParameterError, fault, is_number

THESIS_KEYS = (
    "wheelAmount",
    "wheelRads",
    "wheelDistanceFromCenter",
    "wheelRadius",
    "gearboxReductionRatio",
    "encoderEdgesPerMotorRevolution",
    "pidControlFrequency",
)
KEYS = (*THESIS_KEYS, "referenceDirection", "positiveRotation")
SMALLEST_DETERMINANT = 1e-6  # per n^3; below it some motion needs wheels hundreds of times as fast
ROTATIONS = {"counterclockwise": 1, "clockwise": -1}


class Wheels(NamedTuple):
    """Checked wheel parameters. Tuples hold one value per wheel, in the order of the packets."""

    directions: Tuple[float, ...]  # [rad] yaw of each wheel's positive driving direction in base_link
    distances: Tuple[float, ...]   # [m] centre of the robot to the wheel's contact point
    radii: Tuple[float, ...]       # [m]
    rotation: int                  # body rotation when all wheels turn positive: +1 counterclockwise, -1
    edges_per_turn: float          # encoder edges per turn of a wheel
    pid_frequency: float           # [Hz] PID periods per second

    @property
    def amount(self):
        """Number of wheels."""
        return len(self.directions)

    @property
    def positions(self):
        """[rad] yaw in base_link of the place where each wheel stands."""
        return tuple(direction - self.rotation * math.pi / 2 for direction in self.directions)

    @property
    def metres_per_edge(self):
        """[m] path of each wheel's rim per encoder edge."""
        return tuple(2 * math.pi * radius / self.edges_per_turn for radius in self.radii)


def read_wheels(given):
    """`Wheels` from a mapping with the keys of wheel_params.yaml; other keys are not looked at.

    Raises ParameterError with every fault at once: a missing key, a wrong type or length, a value
    that is not finite or not positive, fewer than 3 wheels, wheels that cannot move the robot in
    every direction (wheel matrix of rank < 3). There are no defaults for the thesis' keys.
    """
    faults = []

    def check(key, valid, allowed):
        """The value of `key`; when it is missing or not `valid`: None, and a fault."""
        if key in given and valid(given[key]):
            return given[key]
        faults.append(fault(key, given.get(key, "nothing"), allowed))
        return None

    amount = check("wheelAmount", lambda v: _is_whole(v) and v >= 3, "a whole number >= 3")
    several = "wheelAmount" if amount is None else str(amount)

    def is_list(value, valid):
        """Whether `value` is a list of valid items, one per wheel."""
        return isinstance(value, (list, tuple)) and len(value) == (amount or len(value)) \
            and all(map(valid, value))

    def check_per_wheel(key, unit):
        """One positive number per wheel, given as a list or as one number for all."""
        value = check(key, lambda v: _is_positive(v) or is_list(v, _is_positive),
                      f"a finite number > 0 [{unit}], or a list of {several} of them")
        return value if isinstance(value, (list, tuple)) else [value] * (amount or 0)

    rads = check("wheelRads", lambda v: is_list(v, is_number),
                 f"a list of {several} finite numbers [rad]")
    distances = check_per_wheel("wheelDistanceFromCenter", "m")
    radii = check_per_wheel("wheelRadius", "m")
    gear = check("gearboxReductionRatio", _is_positive, "a finite number > 0")
    edges = check("encoderEdgesPerMotorRevolution", _is_whole, "a whole number > 0")
    frequency = check("pidControlFrequency", _is_positive, "a finite number > 0 [Hz]")
    given = {"referenceDirection": 0.0, "positiveRotation": "counterclockwise", **given}
    reference = check("referenceDirection", is_number, "a finite number [rad]")
    rotation = check("positiveRotation", lambda v: isinstance(v, str) and v in ROTATIONS,
                     " or ".join(sorted(ROTATIONS)))
    if faults:
        raise ParameterError(faults)

    wheels = Wheels(
        directions=tuple(rad + reference for rad in rads),
        distances=tuple(map(float, distances)),
        radii=tuple(map(float, radii)),
        rotation=ROTATIONS[rotation],
        edges_per_turn=float(gear * edges),
        pid_frequency=float(frequency),
    )
    if not can_move_every_way(wheels):
        raise ParameterError([fault("wheelRads", list(rads), (
            "angles at which the wheels can move the robot in every direction and turn it "
            "(these give a wheel matrix of rank < 3)"))])
    return wheels


def can_move_every_way(wheels):
    """Whether the wheel matrix has rank 3, with some reserve.

    Seen from its Gram determinant, with lengths in units of the largest distance: n^3/4 for n evenly
    placed wheels, 0 for rank 2.
    """
    largest = max(wheels.distances)
    rows = np.array([(math.cos(direction), math.sin(direction), distance / largest)
                     for direction, distance in zip(wheels.directions, wheels.distances)])
    return bool(np.linalg.det(rows.T @ rows) > SMALLEST_DETERMINANT * len(rows) ** 3)


def _is_positive(value):
    return is_number(value) and value > 0


def _is_whole(value):
    return _is_positive(value) and isinstance(value, int)
