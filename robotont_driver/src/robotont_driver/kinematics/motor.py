"""The motors behind the wheels, as the wheel parameters describe them; without a word, Pololu's 37D at 12 V."""

import math
from typing import NamedTuple

NO_LOAD_SPEED = 2 * math.pi * 156.25  # [rad/s] of the motor's own shaft: 500 rpm behind a gearbox of 18.75
STALL_TORQUE = 0.0315   # [N m] at that shaft: 0.59 N m behind the gearbox
ROTOR_INERTIA = 1.2e-6  # [kg m^2]
BODY_MASS = 3.0         # [kg] of a robot without its wheels: plates, battery, computer, camera
WHEEL_MASS = 0.192      # [kg] hub and rollers
FULL_BATTERY = 1.4      # 4-cell LiPo, 16.8 V, over 12 V
RESERVE = 1.07          # for motors that are faster than their data sheet


class Motor(NamedTuple):
    """One of the robot's motors, all alike, at its rated voltage and at its own shaft."""

    no_load_speed: float = NO_LOAD_SPEED  # [rad/s]
    stall_torque: float = STALL_TORQUE    # [N m]
    rotor_inertia: float = ROTOR_INERTIA  # [kg m^2]


def like_default(no_load_speed):
    """A `Motor` of which only the no-load speed [rad/s] is known: the default one behind a gearbox without losses.

    Its greatest power and its time constant are those of the default.
    """
    ratio = NO_LOAD_SPEED / no_load_speed
    return Motor(no_load_speed, STALL_TORQUE * ratio, ROTOR_INERTIA * ratio ** 2)


def counts_in_reach(wheels):
    """Largest number of encoder edges that a motor makes in one PID period, on a full battery, with a reserve."""
    turns = wheels.motor.no_load_speed / (2 * math.pi) / wheels.pid_frequency  # per period
    return round(turns * FULL_BATTERY * RESERVE * wheels.edges_per_motor_turn)


def no_load_speeds(wheels):
    """[m/s] of each wheel's rim without load, at the rated voltage."""
    return tuple(radius * wheels.motor.no_load_speed / wheels.gear for radius in wheels.radii)
