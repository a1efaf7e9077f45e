"""Synthetic calibration runs: wheels that differ from their parameters, with noise, and measured poses."""

import math

import numpy as np

from robotont_calibration.calibration import Stretch, stretches_of
from robotont_calibration.trajectory import Trajectory
from robotont_driver.wheels import read_wheels
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, spin, square, straight

NOISE = 0.001                        # [m] after 1 m; the simulator's wheels have 0.0003
TRACKED = (0.001, math.radians(0.1))  # [m], [rad] a ground truth's
TAPE = (0.002, math.radians(0.5))     # [m], [rad] a tape's and a ruler's


def true_of(wrong, radius=1.0, distance=1.0, angles=()):
    """Parameters of the real robot, for `wrong` ones: what they are larger by, in parts and in degrees."""
    rads = list(wrong["wheelRads"])
    for wheel, degrees in angles:
        rads[wheel] -= math.radians(degrees)
    return {**wrong, "wheelRads": rads, "wheelRadius": wrong["wheelRadius"] / radius,
            "wheelDistanceFromCenter": (np.asarray(wrong["wheelDistanceFromCenter"]) / distance).tolist()}


def drives():
    """The runs that the guide asks for, as twists."""
    return [square(2.0, 1), square(2.0, -1), spin(10 * math.pi), spin(-10 * math.pi),
            straight(0, 3.0), straight(0, -3.0)]


def recorded(parameters, twists, seed, deviation):
    """(counts, K x 3 measured poses) of a robot with these parameters."""
    wheels = read_wheels(parameters)
    generator = np.random.default_rng(seed)
    counts = counted(wheels, rolled(wheels, twists), NOISE, generator)
    poses = path_of(twists)[1:]
    place, yaw = deviation
    return counts, poses + generator.standard_normal(poses.shape) * (place, place, yaw)


def tracked_runs(parameters, seed=0):
    """Stretches of all runs with a ground truth."""
    found = []
    for index, twists in enumerate(drives()):
        counts, poses = recorded(parameters, twists, seed + index, TRACKED)
        times = PERIOD * np.arange(1, len(counts) + 1)
        found += stretches_of(times, counts, Trajectory(times, poses), 2.0, TRACKED)
    return found


def taped_runs(parameters, seed=0):
    """Stretches of all runs with ends measured by tape only; the start, too, is a little off its mark."""
    found = []
    for index, twists in enumerate(drives()):
        counts, poses = recorded(parameters, twists, seed + index, TAPE)
        x, y, yaw = poses[-1]
        along, across, turn = np.random.default_rng(seed + index + 500).standard_normal(3) * (TAPE[0], *TAPE)
        moved = (math.cos(turn) * x + math.sin(turn) * y + along, math.cos(turn) * y - math.sin(turn) * x + across,
                 yaw - turn)
        found.append(Stretch(counts, moved, TAPE))
    return found
