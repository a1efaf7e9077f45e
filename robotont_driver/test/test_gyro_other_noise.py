"""A gyro beside the wheels, on drives and noise of the other generator."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import GYRO_BIAS_DRIFT, GYRO_SCALE_NOISE, PARAMETERS
from robotont_driver.odometry.gyro import Gyro
from robotont_driver.odometry.gyro_fusion import GyroFusion
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.timing.odometry_stamps import SECOND
from robotont_testing import other_noise
from robotont_testing.robots import SHIPPED

PERIOD = other_noise.PERIOD
THREE = read_wheels(SHIPPED)
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}


class Run:
    """Odometry with its defaults along true twists, after a stand of 2 s."""

    def __init__(self, twists, rng, **gyro):
        twists = np.concatenate([np.zeros((100, 3)), twists])
        self.fusion = GyroFusion(
            Gyro(PERIOD, DEFAULTS["gyro_noise"], GYRO_BIAS_DRIFT, DEFAULTS["gyro_scale"], GYRO_SCALE_NOISE),
            DEFAULTS["slip_false_alarms"])
        self.odometry = WheelOdometry(Kinematics(THREE), PERIOD, DEFAULTS["wheel_noise"], self.fusion)
        self.refused_at = None
        counts = other_noise.counts(THREE, twists, rng, 0.012).tolist()
        samples = list(zip(*[part.tolist() for part in other_noise.gyro(twists, rng, **gyro)]))[::-1]
        for index, packet in enumerate(counts):
            now = (index + 1) * PERIOD
            while samples and samples[-1][0] <= now + 0.005:
                stamp, rate = samples.pop()
                self.fusion.integral.add(round(stamp * SECOND), rate)
            self.odometry.update(packet, PERIOD, round(now * SECOND))
            if self.fusion.agreement.refused and self.refused_at is None:
                self.refused_at = now - 2.0
        self.error = se2.wrap(self.odometry.pose.yaw - twists[:, 2].sum() * PERIOD)
        self.stated = math.sqrt(self.odometry.pose_covariance.aa)


CASES = {
    "a scale that is 1 % too large": {"scale": 0.01},
    "a scale that is 1 % too small": {"scale": -0.01},
    "scales that are 1 % off": {"scale": lambda rng: rng.normal(0, 0.01)},
    "a bias that walks ten times as far": {"scale": lambda rng: rng.normal(0, 0.01), "walk": 1e-4},
    "dropouts": {"scale": lambda rng: rng.normal(0, 0.01), "dropouts": 0.1},
}


@pytest.mark.parametrize("seeds", [10, pytest.param(40, marks=pytest.mark.long)])
@pytest.mark.parametrize("case", CASES)
def test_the_heading_is_as_good_as_stated(case, seeds):
    """The mean normalised squared error of minutes of joystick within its bounds of 99 %, and no false alarm."""
    errors = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        gyro = {key: value(rng) if callable(value) else value for key, value in CASES[case].items()}
        run = Run(other_noise.joystick(60, rng), rng, **gyro)
        errors.append((run.error / run.stated) ** 2)
        assert run.fusion.watch.alarms == 0
    low, high = chi2.ppf((0.005, 0.995), seeds) / seeds
    assert low < np.mean(errors) < high


@pytest.mark.parametrize("drive", [other_noise.circles(rounds=2), other_noise.squares(rounds=2),
                                   other_noise.joystick(60, np.random.default_rng(1))],
                         ids=["circles", "squares", "joystick"])
@pytest.mark.parametrize("wrong", [{"scale": -2.0}, {"axis": 0}], ids=["sign", "axis"])
def test_a_gyro_that_turns_otherwise_is_refused_and_what_it_gave_is_taken_back(wrong, drive):
    run = Run(drive, np.random.default_rng(3), **wrong)
    turning = np.abs(drive[:round(run.refused_at / PERIOD), 2]) > 0.2
    assert turning.sum() * PERIOD <= 10.0
    assert run.fusion.agreement.per_turn == pytest.approx(1.0 + wrong.get("scale", -1.0), abs=0.2)
    assert run.error ** 2 < 3 ** 2 * run.stated ** 2
    assert not run.fusion.watch.suspects
