"""The simulated inertial measurement unit: true turns and accelerations, with errors as large as said."""

import math

import numpy as np
import pytest
import rospy
from lockstep import LockstepRun
from robot_runs import ROBOTS

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_simulator import simulation as imu
from robotont_simulator.simulation import GRAVITY, ImuErrors, Simulation
from robotont_simulator.simulator_node import PARAMETERS, Sensors
from robotont_simulator.world import World


def new_simulation(imu_rate):
    return Simulation(read_wheels(ROBOTS[3]), World(), seed=1, imu_rate=imu_rate)


def test_readings_add_up_to_the_turn_and_weigh_the_robot():
    simulation = new_simulation(imu_rate=250)
    errors = simulation.imu_errors
    errors.scale, errors.bias = np.ones(6), np.zeros(6)
    run = LockstepRun(simulation)
    rates, accelerations = [], []
    for _ in range(150):
        run.drive([(0.0, 0.0, 1.0)])
        assert len(simulation.imu_readings) == 5
        rates += [reading[:3] for reading in simulation.imu_readings]
        accelerations += [reading[3:] for reading in simulation.imu_readings]
    turned = np.sum(rates, axis=0) * simulation.imu_interval
    true = run.path[-1][2][2]
    assert true > 2.5
    np.testing.assert_allclose(turned, (0.0, 0.0, true), atol=5 * imu.NOISE[0] * math.sqrt(3.0))
    np.testing.assert_allclose(np.mean(accelerations, axis=0), (0.0, 0.0, GRAVITY), atol=0.02)


def test_it_does_not_change_the_physics():
    ends = []
    for rate in (0.0, 250.0, 100.0):
        simulation = new_simulation(imu_rate=rate)
        ends.append(LockstepRun(simulation).hold((0.3, 0.1, 0.5), 1.0))
        assert len(simulation.imu_readings) == max(1, rate / 50)
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.parametrize("rate, found", [(200.0, 100.0), (1000.0, 500.0), (50.0, 50.0)])
def test_the_rate_is_rounded_down_to_what_fits_the_steps(rate, found):
    assert 1 / new_simulation(imu_rate=rate).imu_interval == pytest.approx(found)


def test_errors_are_as_large_as_the_data_sheet_says():
    rate = 250.0
    devices = [ImuErrors(rate, np.random.default_rng(seed)) for seed in range(40)]
    starts = np.array([errors.bias[:3] for errors in devices])
    readings = np.array([[errors.measure(np.zeros(6))[:3] for _ in range(round(rate))]
                         for errors in devices])  # over 1 s
    for errors in devices[:10]:
        for _ in range(round(rate * 20)):
            errors.measure(np.zeros(6))
    walks = [errors.bias[:3] - start for errors, start in zip(devices[:10], starts)]
    assert np.std(starts) == pytest.approx(imu.BIAS[0], rel=0.3)
    assert np.std([errors.scale[:3] - 1 for errors in devices]) == pytest.approx(imu.SCALE[0], rel=0.5)
    assert np.std(readings.mean(axis=1) - starts) == pytest.approx(imu.NOISE[0], rel=0.3)
    assert np.std(walks) == pytest.approx(imu.DRIFT[0] * math.sqrt(21), rel=0.5)


@pytest.mark.parametrize("rate, announced", [(10.0, True), (0.0, False)])
def test_a_scanner_that_is_off_is_not_announced(rate, announced, monkeypatch):
    """Else a guard takes it for one that is there, and does not speak."""
    topics = []
    monkeypatch.setattr(rospy, "Publisher", lambda topic, *_, **__: topics.append(topic))
    monkeypatch.setattr(rospy, "get_param", lambda _, default: default)
    parameters = {**{parameter.name: parameter.default for parameter in PARAMETERS}, "scan_rate": rate}
    Sensors(new_simulation(imu_rate=250), 50.0, parameters)
    assert ("scan" in topics) == announced
    assert "imu" in topics
