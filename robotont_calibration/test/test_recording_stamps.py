"""Odometry from the packets of a recording stands at the times when they were made, so that a report has no spikes."""

import numpy as np

from robotont_calibration.recordings import Recording
from robotont_calibration.trajectory import Trajectory
from robotont_calibration.trajectory_errors import Report
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, still, straight

WHEELS = read_wheels(SHIPPED)


def largest_error(stamped):
    """[mm] of a drive whose packets came up to 30 ms late, in order; stamped: their arrivals are taken for stamps."""
    twists = np.concatenate([still(2.0), straight(3.0, 1.0), still(1.0)])
    times = PERIOD * np.arange(1, len(twists) + 1)
    arrivals = np.maximum.accumulate(times + np.random.default_rng(1).uniform(0.0, 0.03, len(times)))
    recording = Recording()
    recording.stamped = stamped
    counts = counted(WHEELS, rolled(WHEELS, twists)).tolist()
    recording.packets = [(at, tuple(packet)) for at, packet in zip(arrivals, counts)]
    truth = Trajectory(np.concatenate([[0.0], times]), path_of(twists))
    return 1000 * Report(recording.recomputed(Kinematics(WHEELS)), truth, "truth").distances.max()


def test_no_spikes():
    by_number, by_arrival = largest_error(False), largest_error(True)
    print(f"largest error {by_number:.2f} mm; by arrival {by_arrival:.1f} mm")
    assert by_number < 1.0
    assert by_arrival > 5.0
