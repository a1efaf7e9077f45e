"""Wheels and gyro together in the physics: heading after circles, and a wheel of three that slips."""

import math

import numpy as np
import pytest
from robot_runs import ROBOTS
from scipy.stats import chi2

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.gyro import SECOND, Gyro
from robotont_driver.odometry.gyro_fusion import GyroFusion
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_simulator import imu
from robotont_simulator.lockstep import LockstepRun
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World

WHEELS = read_wheels(ROBOTS[3])
SEEDS = 20


class GyroRun(LockstepRun):
    """A lockstep run whose odometry has the gyro. `off` [deg]: heading minus the true one; `suspects` per packet."""

    def __init__(self, seed):
        simulation = Simulation(WHEELS, World((), (0.0, 0.0, 0.0)), seed, imu_rate=250.0)
        super().__init__(simulation)
        period = 1.0 / WHEELS.pid_frequency
        self.fusion = GyroFusion(Gyro(period, imu.GYRO_NOISE, imu.GYRO_DRIFT, 1.0, imu.GYRO_SCALE), 0.1)
        self.with_gyro = WheelOdometry(Kinematics(WHEELS), period, 0.005, gyro=self.fusion)
        self.suspects = []

    def write(self, data):
        before = len(self.counts)
        super().write(data)
        now = self.simulation.time
        interval = self.simulation.imu_interval
        readings = self.simulation.imu_readings
        for later, (rates, _) in zip(range(len(readings) - 1, -1, -1), readings):
            self.fusion.add(round((now - later * interval) * SECOND), rates.tolist(), (0.0, 0.0, 1.0))
        for counts in self.counts[before:]:
            self.with_gyro.update(counts, 0.0, round(now * SECOND))
            self.suspects.append(self.fusion.watch.suspects)

    @property
    def off(self):
        return math.degrees(se2.wrap(self.with_gyro.pose.yaw - self.simulation.pose()[2]))


@pytest.mark.long
def test_two_circles_with_twenty_seeds():
    errors, stated, alone = [], [], []
    for seed in range(SEEDS):
        run = GyroRun(seed)
        run.hold((0.0, 0.0, 0.0), 4.0)
        run.hold((0.3, 0.0, 1.2), 4 * math.pi / 1.2)
        run.hold((0.0, 0.0, 0.0), 1.0)
        errors.append(run.off)
        stated.append(math.degrees(math.sqrt(run.with_gyro.pose_covariance.aa)))
        alone.append(math.degrees(se2.wrap(run.odometry.pose.yaw - run.simulation.pose()[2])))
        assert run.fusion.watch.alarms == 0
    errors, stated = np.array(errors), np.array(stated)
    value = float(np.mean((errors / stated) ** 2))
    print(f"heading after two circles: {np.sqrt(np.mean(errors ** 2)):.2f} deg rms, {np.abs(errors).max():.2f} at "
          f"most, stated {stated.mean():.2f}; wheels alone {np.abs(alone).max():.2f}")
    print("mean normalised error squared {:.2f}, 95 % bounds {:.2f} to {:.2f}".format(
        value, *chi2.ppf((0.025, 0.975), SEEDS) / SEEDS))
    low, high = chi2.ppf((0.0005, 0.9995), SEEDS) / SEEDS
    assert low < value < high
    assert np.abs(errors).max() < 1.0


@pytest.mark.parametrize("wheel, twist", [(0, (0.4, 0.0, 0.0)), (1, (0.0, 0.4, 0.0))], ids=str)
def test_a_wheel_of_three_without_grip_is_named(wheel, twist):
    run = GyroRun(1)
    run.hold((0.0, 0.0, 0.0), 3.0)
    run.simulation.set_grip(wheel, 0.02)
    start = len(run.suspects)
    run.hold(twist, 1.5)
    yaw = np.unwrap([truth[2] for _, _, truth in run.path[start:]])
    turned = next(index for index, angle in enumerate(yaw) if abs(angle - yaw[0]) > math.radians(1.0))
    named = next(index for index, suspects in enumerate(run.suspects[start:]) if suspects)
    wheels_alone = math.degrees(se2.wrap(run.odometry.pose.yaw - run.simulation.pose()[2]))
    print(f"wheel {wheel} named {run.suspects[start + named]} {(named - turned) / 50:+.2f} s after the robot had "
          f"turned by 1 degree, {named / 50:.2f} s after the command")
    print(f"heading {run.off:+.1f} deg, wheels alone {wheels_alone:+.1f}")
    assert (named - turned) / 50 <= 0.3
    assert wheel in run.suspects[start + named]
    assert abs(run.off) < 3.0
