"""False alarms of the search for slip, and what it finds, on drives and noise of the other generator."""

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheels import read_wheels
from robotont_driver.odometry.slip import TOLERANCE, WINDOW, SlipDetector
from robotont_testing import other_noise
from robotont_testing.simulated_wheels import even_wheels

FALSE_ALARMS = 0.1  # [1/h]
RATE = 50
HOUR = 3600


def detector(wheels, noise):
    return SlipDetector(Kinematics(wheels).matrix, wheels.metres_per_edge, noise, FALSE_ALARMS, RATE)


def windows(values):
    """Sums over each `WINDOW` rows and, at the start, fewer."""
    sums = np.vstack([np.zeros((WINDOW, values.shape[1])), np.cumsum(values, axis=0)])
    return sums[WINDOW:] - sums[:-WINDOW]


def complaints(finder, counts):
    """Times that clean counts would exclude a wheel, by the code of `finder` for all packets at once."""
    counts = counts[counts.any(axis=1)].astype(float)
    paths, ways = windows(counts), windows(np.abs(counts))
    excess = np.empty((len(counts), 1))
    for index in range(0, len(counts), WINDOW):  # what it learns, from each window that shares nothing with the last
        excess[index:index + WINDOW] = finder._excess
        finder._path, finder._way, finder._unlearnt = paths[index], ways[index], 0
        finder._paths = finder._path * finder._edge
        finder._learn()
    learnt, finder._excess, finder._path, finder._way = finder._excess, excess, paths, ways
    variances = finder._noise_variances() + (TOLERANCE * paths) ** 2
    finder._excess = learnt
    values = finder._fit(1.0 / (variances * finder._edge ** 2), paths * finder._edge)[1]
    over = np.flatnonzero(values > finder._limits[counts.shape[1]])
    return int(np.sum(np.diff(over, prepend=-RATE) >= RATE)), values


def test_the_windows_at_once_are_those_of_the_detector():
    wheels = read_wheels(even_wheels(5))
    rng = np.random.default_rng(0)
    counts = other_noise.counts(wheels, other_noise.joystick(120, rng), rng, 0.012)
    finder, values = detector(wheels, 0.012), []
    for packet in counts[counts.any(axis=1)].tolist():
        finder.update(packet)
        values.append(finder.parity_test()[0])
    other = detector(wheels, 0.012)
    assert complaints(other, counts)[1] == pytest.approx(np.array(values), rel=0.05)
    assert other.noise == pytest.approx(finder.noise, rel=0.02)


def false_alarms(number, noise, hours, stated=0.012, drives=5):
    """In so many hours, each begun anew; the noise learnt, over the stated one."""
    wheels = read_wheels(even_wheels(number))
    rng = np.random.default_rng([number, int(1e6 * noise)])
    roads = [other_noise.joystick(HOUR, rng) for _ in range(min(drives, hours))]
    alarms = 0
    for hour in range(hours):
        finder = detector(wheels, stated)
        alarms += complaints(finder, other_noise.counts(wheels, roads[hour % drives], rng, noise))[0]
    print(f"{number} wheels, noise {1000 * noise:g} mm, stated {1000 * stated:g}: {alarms} false alarms in {hours} h; "
          f"learnt {1000 * finder.noise * stated:.1f} mm", flush=True)
    return alarms
