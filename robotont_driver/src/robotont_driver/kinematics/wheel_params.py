"""The wheels and the drive train: the thesis' seven keys (Figure 4, Table 1), and optional ones of our own."""

import math
from collections.abc import Mapping
from typing import NamedTuple, Tuple

from robotont_driver.kinematics.kinematics import condition, wheel_matrix
from robotont_driver.parameters.parameters import ParameterError, fault, is_number, is_whole

NO_LOAD_SPEED = 2 * math.pi * 156.25  # [rad/s] of the motor's own shaft: 500 rpm behind a gearbox of 18.75
STALL_TORQUE = 0.0315   # [N m] at that shaft: 0.59 N m behind the gearbox
ROTOR_INERTIA = 1.2e-6  # [kg m^2]
BODY_MASS = 3.0         # [kg] of a robot without its wheels: plates, battery, computer, camera
WHEEL_MASS = 0.192      # [kg] hub and rollers
FULL_BATTERY = 1.4      # 4-cell LiPo, 16.8 V, over 12 V
RESERVE = 1.07          # for motors that are faster than their data sheet


class Motor(NamedTuple):
    """One of the robot's motors, all alike, at 12 V and at its own shaft."""

    no_load_speed: float = NO_LOAD_SPEED  # [rad/s]
    stall_torque: float = STALL_TORQUE    # [N m]
    rotor_inertia: float = ROTOR_INERTIA  # [kg m^2]


def counts_in_reach(wheels):
    """Largest number of encoder edges that a motor makes in one PID period, on a full battery, with a reserve."""
    turns = wheels.motor.no_load_speed / (2 * math.pi) / wheels.pid_frequency  # per period
    return round(turns * FULL_BATTERY * RESERVE * wheels.edges_per_motor_turn)


def no_load_speeds(wheels):
    """[m/s] of each wheel's rim without load, at 12 V."""
    return tuple(radius * wheels.motor.no_load_speed / wheels.gear for radius in wheels.radii)


THESIS_KEYS = ("wheelAmount", "wheelRads", "wheelDistanceFromCenter", "wheelRadius", "gearboxReductionRatio",
               "encoderEdgesPerMotorRevolution", "pidControlFrequency")
OPTIONAL_KEYS = ("referenceDirection", "positiveRotation", "wheelPositionRads", "motorNoLoadSpeed", "motorStallTorque",
                 "motorRotorInertia", "robotMass", "measuredPoint")
KEYS = (*THESIS_KEYS, *OPTIONAL_KEYS)
MOST_WHEELS = 16           # their packets fit into a line: 160 bytes to the board, 256 bytes from it
# Beyond any robot: a mistake.
LARGEST_ANGLE = 4 * math.pi  # [rad] more is meant in degrees
SMALLEST_LENGTH, LARGEST_LENGTH = 0.001, 10.0  # [m] more is meant in millimetres
LARGEST_WHEEL = 2.0        # radius per distance from the centre; larger wheels are meant in other units
WIDEST_GAP = math.radians(200)  # between wheels next to each other: all stand on one side
SLOWEST, FASTEST = 0.02, 20.0  # [m/s] of a robot's rims without load; others are meant in other units, or another motor
SAME_PLACE = 0.01          # [rad] between wheels that cannot both stand there
MOST_CONDITION = 300.0     # beyond it some motion needs wheels hundreds of times as fast as another
NUMBERS = {                # least and most of what is one number for the whole robot, and its unit
    "gearboxReductionRatio": (0.01, 10000.0, ""),         # motor turns per wheel turn
    "encoderEdgesPerMotorRevolution": (1, 2 ** 20, ""),   # edges per turn of the motor
    "pidControlFrequency": (1.0, 1000.0, " [Hz]"),        # PID periods per second
    "motorNoLoadSpeed": (1.0, 5000.0, " [rad/s] of the motor's own shaft"),
    "motorStallTorque": (1e-4, 1000.0, " [N m] at the motor's own shaft"),
    "motorRotorInertia": (1e-9, 1.0, " [kg m^2]"),
    "robotMass": (0.05, 1000.0, " [kg]"),
}
ROTATIONS = {"counterclockwise": 1, "clockwise": -1}


class Wheels(NamedTuple):
    """Checked wheel parameters. Tuples hold one value per wheel, in the order of the packets."""

    directions: Tuple[float, ...]  # [rad] yaw of each wheel's positive driving direction in base_link
    positions: Tuple[float, ...]   # [rad] yaw in base_link of the place where each wheel stands
    distances: Tuple[float, ...]   # [m] centre of the robot to the wheel's contact point
    levers: Tuple[float, ...]      # [m] path of each wheel per rad that the robot turns counterclockwise
    radii: Tuple[float, ...]       # [m]
    gear: float                    # motor turns per turn of a wheel
    edges_per_motor_turn: int      # encoder edges per turn of a motor
    pid_frequency: float           # [Hz] PID periods per second
    motor: Motor
    mass: float                    # [kg] of the whole robot

    @property
    def amount(self):
        """Number of wheels."""
        return len(self.directions)

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

    Raises ParameterError with every fault of the values, or else of how they fit together, as a matrix of rank < 3.
    """
    if not isinstance(given, Mapping):
        raise ParameterError([fault("wheel parameters", given, "parameters by name: " + ", ".join(KEYS))])
    reader = _Reader(given)
    placed = "wheelPositionRads" in given
    rads = reader.angles("wheelRads")
    distances = reader.lengths("wheelDistanceFromCenter", 0.0 if placed else SMALLEST_LENGTH)
    radii = reader.lengths("wheelRadius", SMALLEST_LENGTH)
    gear, edges, frequency = map(reader.number, THESIS_KEYS[4:])
    speed, torque, inertia, mass = (
        reader.number(key, None) for key in ("motorNoLoadSpeed", "motorStallTorque", "motorRotorInertia", "robotMass"))
    reference = reader.check("referenceDirection", _is_angle, f"a number up to {LARGEST_ANGLE:.2f} [rad]"
                             + reader.meant("referenceDirection", LARGEST_ANGLE, "degrees", math.pi / 180), 0.0)
    reader.check("measuredPoint", lambda v: isinstance(v, (list, tuple)) and len(v) == 2
                 and all(is_number(part) and abs(part) <= LARGEST_LENGTH for part in v),
                 f"[x, y], two numbers up to {LARGEST_LENGTH:g} [m]: which point of base_link a ground truth is of", ())
    if placed:
        places = reader.angles("wheelPositionRads")
        reader.check("positiveRotation", lambda _: False,
                     "nothing beside wheelPositionRads, which tells where each wheel stands", "")
    else:
        words = reader.per_wheel("positiveRotation", lambda v: isinstance(v, str) and v in ROTATIONS,
                                 "clockwise or counterclockwise, or a list of them, one per wheel", "counterclockwise")
    if not reader.faults and max(radii) > LARGEST_WHEEL * max(distances):
        reader.faults.append(fault("wheelRadius", given["wheelRadius"], (
            f"up to {LARGEST_WHEEL:g} times wheelDistanceFromCenter, {given['wheelDistanceFromCenter']} [m]: are both "
            "in metres?")))
    if reader.faults:
        raise ParameterError(reader.faults)

    if not placed:
        places = [rad - ROTATIONS[word] * math.pi / 2 for rad, word in zip(rads, words)]
    directions, positions = (tuple(rad + reference for rad in angles) for angles in (rads, places))
    distances = tuple(map(float, distances))
    levers = tuple(distance * math.sin(direction - position)
                   for direction, position, distance in zip(directions, positions, distances))
    speed = speed or NO_LOAD_SPEED
    ratio = NO_LOAD_SPEED / speed  # what is not told of the motor is as if the default one had a gearbox more
    wheels = Wheels(
        directions=directions, positions=positions, distances=distances, levers=levers,
        radii=tuple(map(float, radii)), gear=float(gear), edges_per_motor_turn=int(edges),
        pid_frequency=float(frequency),
        motor=Motor(speed, torque or STALL_TORQUE * ratio, inertia or ROTOR_INERTIA * ratio ** 2),
        mass=float(mass or BODY_MASS + WHEEL_MASS * len(directions)),
    )
    if condition(wheel_matrix(wheels)) > MOST_CONDITION:
        raise ParameterError([fault("wheelRads", list(rads), (
            "angles at which the wheels can move the robot in every direction and turn it "
            "(these give a wheel matrix of rank < 3, or nearly)" + _at_one_place(wheels)))])
    return wheels


class _Reader:
    """Values of a mapping by key, checked; `faults` lists what is wrong."""

    def __init__(self, given):
        self.faults = []
        self._given = given
        amount = self.check("wheelAmount", lambda v: is_whole(v) and 3 <= v <= MOST_WHEELS,
                            f"a whole number from 3 to {MOST_WHEELS}, the wheels whose packets fit into a line")
        self._amount = amount and int(amount)
        self._several = "a list of " + ("wheelAmount" if amount is None else str(self._amount))

    def check(self, key, valid, allowed, *default):
        """The value of `key`, or the default; when there is none or it is not `valid`: None, and a fault."""
        if default and key not in self._given:
            return default[0]
        if key in self._given and valid(self._given[key]):
            return self._given[key]
        self.faults.append(fault(key, self._given.get(key, "nothing"), allowed))
        return None

    def number(self, key, *default):
        """One of NUMBERS."""
        least, most, unit = NUMBERS[key]
        kind, valid = ("a whole number", is_whole) if isinstance(most, int) else ("a number", is_number)
        return self.check(key, lambda v: valid(v) and least <= v <= most, f"{kind} from {least:g} to {most:.10g}{unit}",
                          *default)

    def per_wheel(self, key, valid, allowed, *default):
        """One value per wheel, given as a list or as one for all."""
        value = self.check(key, lambda v: valid(v) or self._is_list(v, valid), allowed, *default)
        return value if isinstance(value, (list, tuple)) else [value] * (self._amount or 0)

    def lengths(self, key, least):
        """One length [m] per wheel."""
        return self.per_wheel(key, lambda v: is_number(v) and least <= v <= LARGEST_LENGTH,
                              f"a number from {least:g} to {LARGEST_LENGTH:g} [m], or {self._several}"
                              + self.meant(key, LARGEST_LENGTH, "millimetres", 0.001, SMALLEST_LENGTH))

    def angles(self, key):
        """One angle [rad] per wheel, a list."""
        return self.check(key, lambda v: self._is_list(v, _is_angle), (
            f"{self._several} numbers up to {LARGEST_ANGLE:.2f} [rad]"
            + self.meant(key, LARGEST_ANGLE, "degrees", math.pi / 180)))

    def meant(self, key, largest, unit, factor, least=0.0):
        """Hint about numbers beyond `largest` that are right in another unit, as `factor` times them; else empty."""
        # none of those but zeros may be below `least`: else some are in this unit already
        value = self._given.get(key)
        numbers = [value] if is_number(value) else value
        if not self._is_list(numbers, is_number) and numbers is value:
            return ""
        converted = [round(factor * number, 6) for number in numbers]
        sizes = list(map(abs, converted))
        if not factor * largest < max(sizes, default=0.0) <= largest or 0 < min(sizes) < least:
            return ""
        if any(number % 1 and abs(number) <= largest / 2 for number in numbers):
            return f"; some in {unit}, others not?"
        return f"; in {unit}? then write {converted if numbers is value else converted[0]}"

    def _is_list(self, value, valid):
        """Whether `value` is a list of valid items, one per wheel."""
        return isinstance(value, (list, tuple)) and len(value) == (self._amount or len(value)) \
            and all(map(valid, value))


def doubts(wheels):
    """Words about `Wheels` that can drive, but are probably meant otherwise; empty for none."""
    fastest = max(no_load_speeds(wheels))
    if not SLOWEST <= fastest <= FASTEST:
        return (f"wheelRadius, gearboxReductionRatio, motorNoLoadSpeed: the wheels reach {fastest:.3g} m/s without "
                f"load, expected: {SLOWEST} to {FASTEST}")
    places = sorted(position % (2 * math.pi) for position in wheels.positions)
    gaps = [after - before for before, after in zip(places, [*places[1:], places[0] + 2 * math.pi])]
    if max(gaps) < WIDEST_GAP:
        same = len(set(wheels.distances)) == 1 and _at_one_place(wheels)
        return f"wheelRads{same.replace(';', ':', 1)}" if same else ""
    return (f"wheelRads: all wheels stand on one side of the centre, at {_degrees(wheels, range(wheels.amount))} "
            "degrees; where a motor is mounted the other way round, positiveRotation, beside wheelRads, is a list")


def _at_one_place(wheels):
    """Why the wheel matrix may lack a rank: a driving direction or a place that wheels have in common; else empty."""
    if all(math.cos(direction - wheels.directions[0]) > 0.999 for direction in wheels.directions):
        return "; all wheels drive in one direction: mecanum wheels are no omni wheels"
    for wheel, position in enumerate(wheels.positions):
        same = [other for other in range(wheels.amount)
                if abs(math.remainder(wheels.positions[other] - position, 2 * math.pi)) < SAME_PLACE]
        if len(same) > 1:
            return (f"; wheels {' and '.join(map(str, same))} would stand at one place, {_degrees(wheels, [wheel])} "
                    "degrees: where motors on two sides drive the same way when they turn positive, positiveRotation "
                    "is a list, one word per wheel")
    return ""


def _degrees(wheels, numbers):
    return ", ".join(f"{math.degrees(wheels.positions[number]) % 360:.0f}" for number in numbers)


def _is_angle(value):
    return is_number(value) and abs(value) <= LARGEST_ANGLE
