"""The wheels and the drive train: the thesis' seven keys (Figure 4, Table 1) and three of our own."""

import math
from collections.abc import Mapping
from typing import NamedTuple, Tuple

from robotont_driver.kinematics.kinematics import wheel_matrix
from robotont_driver.kinematics.least_squares import condition
from robotont_driver.parameters.parameters import ParameterError, fault, is_number

THESIS_KEYS = (
    "wheelAmount",
    "wheelRads",
    "wheelDistanceFromCenter",
    "wheelRadius",
    "gearboxReductionRatio",
    "encoderEdgesPerMotorRevolution",
    "pidControlFrequency",
)
KEYS = (*THESIS_KEYS, "referenceDirection", "positiveRotation", "measuredPoint")
MOST_WHEELS = 16           # their packets fit into a line: 160 bytes to the board, 256 bytes from it
# Beyond any robot: a mistake.
LARGEST_ANGLE = 4 * math.pi  # [rad] more is meant in degrees
SMALLEST_LENGTH, LARGEST_LENGTH = 0.001, 10.0  # [m] more is meant in millimetres
LARGEST_WHEEL = 2.0        # radius per distance from the centre; larger wheels are meant in other units
SMALLEST_GEAR = 0.01       # motor turns per wheel turn
LARGEST_GEAR = 10000.0     # motor turns per wheel turn
MOST_EDGES = 100000        # encoder edges per motor turn
LARGEST_FREQUENCY = 1000.0  # [Hz] PID periods per second
MOST_CONDITION = 300.0     # beyond it some motion needs wheels hundreds of times as fast as another
ROTATIONS = {"counterclockwise": 1, "clockwise": -1}


class Wheels(NamedTuple):
    """Checked wheel parameters. Tuples hold one value per wheel, in the order of the packets."""

    directions: Tuple[float, ...]  # [rad] yaw of each wheel's positive driving direction in base_link
    distances: Tuple[float, ...]   # [m] centre of the robot to the wheel's contact point
    radii: Tuple[float, ...]       # [m]
    rotation: int                  # body rotation when all wheels turn positive: +1 counterclockwise, -1
    gear: float                    # motor turns per turn of a wheel
    edges_per_motor_turn: int      # encoder edges per turn of a motor
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
    def edges_per_turn(self):
        """Encoder edges per turn of a wheel."""
        return self.gear * self.edges_per_motor_turn

    @property
    def metres_per_edge(self):
        """[m] path of each wheel's rim per encoder edge."""
        return tuple(2 * math.pi * radius / self.edges_per_turn for radius in self.radii)


def read_wheels(given):
    """`Wheels` from a mapping with the keys of wheel_params.yaml; other keys are ignored.

    Raises ParameterError with every fault at once: a missing key, a wrong type or length, a value
    that is not finite, not positive or beyond any robot (degrees, millimetres), fewer than 3 wheels or more than
    packets can contain, wheels that cannot move the robot in every direction (wheel matrix of rank < 3). There are no
    defaults for the thesis' keys.
    """
    if not isinstance(given, Mapping):
        raise ParameterError([fault("wheel parameters", given, "parameters by name: " + ", ".join(KEYS))])
    faults = []

    def check(key, valid, allowed):
        """The value of `key`; when it is missing or not `valid`: None, and a fault."""
        if key in given and valid(given[key]):
            return given[key]
        faults.append(fault(key, given.get(key, "nothing"), allowed))
        return None

    amount = check("wheelAmount", lambda v: _is_whole(v) and 3 <= v <= MOST_WHEELS,
                   f"a whole number from 3 to {MOST_WHEELS}, the wheels whose packets fit into a line")
    several = "wheelAmount" if amount is None else str(amount)

    def is_list(value, valid):
        """Whether `value` is a list of valid items, one per wheel."""
        return isinstance(value, (list, tuple)) and len(value) == (amount or len(value)) \
            and all(map(valid, value))

    def is_length(value):
        """Whether `value` is a length that a robot can have."""
        return is_number(value) and SMALLEST_LENGTH <= value <= LARGEST_LENGTH

    def check_per_wheel(key, unit):
        """One positive number per wheel, given as a list or as one number for all."""
        value = check(key, lambda v: is_length(v) or is_list(v, is_length),
                      f"a number from {SMALLEST_LENGTH:g} to {LARGEST_LENGTH:g} [{unit}], or a list of {several}"
                      + meant(given.get(key), LARGEST_LENGTH, "millimetres", 0.001))
        return value if isinstance(value, (list, tuple)) else [value] * (amount or 0)

    rads = check("wheelRads", lambda v: is_list(v, _is_angle),
                 f"a list of {several} numbers up to {LARGEST_ANGLE:.2f} [rad]"
                 + meant(given.get("wheelRads"), LARGEST_ANGLE, "degrees", math.pi / 180))
    distances = check_per_wheel("wheelDistanceFromCenter", "m")
    radii = check_per_wheel("wheelRadius", "m")
    gear = check("gearboxReductionRatio", lambda v: is_number(v) and SMALLEST_GEAR <= v <= LARGEST_GEAR,
                 f"a number from {SMALLEST_GEAR:g} to {LARGEST_GEAR:g}")
    edges = check("encoderEdgesPerMotorRevolution", lambda v: _is_whole(v) and v <= MOST_EDGES,
                  f"a whole number from 1 to {MOST_EDGES}")
    frequency = check("pidControlFrequency", lambda v: _is_positive(v) and 1 <= v <= LARGEST_FREQUENCY,
                      f"a number from 1 to {LARGEST_FREQUENCY:g} [Hz]")
    given = {"referenceDirection": 0.0, "positiveRotation": "counterclockwise", "measuredPoint": (0.0, 0.0), **given}
    reference = check("referenceDirection", _is_angle, f"a number up to {LARGEST_ANGLE:.2f} [rad]"
                      + meant(given["referenceDirection"], LARGEST_ANGLE, "degrees", math.pi / 180))
    rotation = check("positiveRotation", lambda v: isinstance(v, str) and v in ROTATIONS,
                     " or ".join(sorted(ROTATIONS)))
    check("measuredPoint", lambda v: isinstance(v, (list, tuple)) and len(v) == 2
          and all(is_number(part) and abs(part) <= LARGEST_LENGTH for part in v),
          f"[x, y], two numbers up to {LARGEST_LENGTH:g} [m]: which point of base_link a ground truth is of")
    if not faults and max(radius / distance for radius, distance in zip(radii, distances)) > LARGEST_WHEEL:
        faults.append(fault("wheelRadius", given["wheelRadius"], f"up to {LARGEST_WHEEL:g} times "
                            f"wheelDistanceFromCenter, {given['wheelDistanceFromCenter']} [m]: are both in metres?"))
    if faults:
        raise ParameterError(faults)

    wheels = Wheels(
        directions=tuple(rad + reference for rad in rads),
        distances=tuple(map(float, distances)),
        radii=tuple(map(float, radii)),
        rotation=ROTATIONS[rotation],
        gear=float(gear),
        edges_per_motor_turn=edges,
        pid_frequency=float(frequency),
    )
    if condition(wheel_matrix(wheels)) > MOST_CONDITION:
        raise ParameterError([fault("wheelRads", list(rads), (
            "angles at which the wheels can move the robot in every direction and turn it "
            "(these give a wheel matrix of rank < 3)"))])
    return wheels


def meant(value, largest, unit, factor):
    """Hint about numbers beyond `largest` that are right in another unit, as `factor` times them; else empty."""
    numbers = value if isinstance(value, (list, tuple)) else [value]
    if not 0 < len(numbers) <= MOST_WHEELS or not all(map(is_number, numbers)):
        return ""
    converted = [round(factor * number, 6) for number in numbers]
    if max(map(abs, numbers)) <= largest or max(map(abs, converted)) > largest:
        return ""
    return f"; in {unit}? then write {converted if numbers is value else converted[0]}"


def _is_positive(value):
    return is_number(value) and value > 0


def _is_angle(value):
    return is_number(value) and abs(value) <= LARGEST_ANGLE


def _is_whole(value):
    return _is_positive(value) and isinstance(value, int)
