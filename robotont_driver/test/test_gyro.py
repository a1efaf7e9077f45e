"""A gyro beside the wheels: heading, covariance, bias, gaps, wheels that slip, and 24 ways in which it may be wrong."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import GYRO_BIAS_DRIFT, GYRO_SCALE_NOISE, PARAMETERS
from robotont_driver.odometry.gyro_fusion import GAP, GyroFusion
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.odometry_stamps import SECOND, OdometryStamps
from robotont_driver.odometry.slip import SlipSearch
from robotont_testing import other_noise, rough_noise
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, path_of

THREE = read_wheels(SHIPPED)
KINEMATICS = Kinematics(THREE)
UNITS = KINEMATICS.matrix.T / np.array(THREE.metres_per_edge) * PERIOD  # per m/s
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}
STANDS = 100  # packets before each drive
EPOCH = 10 ** 15  # [ns]


class Run:
    """Odometry as odom_node makes it, of a robot that stands for 2 s first."""

    def __init__(self, scale_noise=GYRO_SCALE_NOISE):
        self.fusion = GyroFusion(
            PERIOD, THREE.metres_per_edge, DEFAULTS["gyro_noise"], GYRO_BIAS_DRIFT, 1.0, scale_noise)
        self.search = SlipSearch(KINEMATICS, PERIOD, DEFAULTS["wheel_noise"], DEFAULTS["slip_false_alarms"])
        self.odometry = WheelOdometry(KINEMATICS, PERIOD, DEFAULTS["wheel_noise"], self.fusion)
        self.poses, self.told, self.refused = [], [], []

    def take(self, counts, samples, commanded=None, clock=None, arrivals=None):
        """Take K packets at their time, and (stamps, rates, arrivals) of a gyro [s] as they come."""
        waiting = list(zip(*[part.tolist() for part in samples]))[::-1]
        for index, packet in enumerate(counts.tolist()):
            now = (index + 1) * PERIOD + 0.004 if arrivals is None else arrivals[index]
            while waiting and waiting[-1][2] <= now:
                stamp, rate, _ = waiting.pop()
                self.fusion.add(EPOCH + round(stamp * SECOND), rate)
            at = EPOCH + round(now * SECOND)
            stamp = EPOCH + round((index + 1) * PERIOD * SECOND) if clock is None else clock.stamp(at, at)
            self.odometry.update(packet, 0.0, stamp, self.search.slips)
            self.search.update(packet, None if commanded is None else commanded[index], self.fusion.compared)
            pose = self.odometry.pose
            self.poses.append((pose.x, pose.y, pose.yaw))
            self.told.append(self.search.alike)
            self.refused.append(self.fusion.agreement.refused)
        return self

    def drive(self, twists, rng, noise=0.012, wished=None, slip=None, **gyro):
        """Along true twists."""
        stands = np.zeros((STANDS, 3))
        commanded = None if wished is None else (np.concatenate([stands, wished]) @ UNITS).tolist()
        twists = np.concatenate([stands, twists])
        slip = None if slip is None else np.concatenate([np.zeros((STANDS, 3)), slip])
        counts = rough_noise.counts(THREE, twists, rng, noise, slip=slip)
        self.take(counts, rough_noise.gyro(twists, rng, **gyro), commanded)
        self.truth = path_of(twists)[1:]
        return self

    @property
    def error(self):
        """Of the heading at the end [rad]."""
        return se2.wrap(self.odometry.pose.yaw - self.truth[-1, 2])

    @property
    def nees(self):
        """Normalised squared error of the heading."""
        return self.error ** 2 / self.odometry.pose_covariance.aa


USED = {
    "tilt 5 deg": {"about": math.cos(math.radians(5))}, "100 ppm": {"clock": 1e-4}, "gaps": {"dropouts": 0.1},
    "0.97": {"scale": 0.97}, "1.03": {"scale": 1.03}, "late 100 ms": {"late": 0.1}, "late 200 ms": {"late": 0.2},
    "late 300 ms": {"late": 0.3}, "30 Hz": {"hertz": 30.0}, "stamps 30 ms late": {"stamped": 0.03},
    "saturates": {"most": 1.1},
}
REFUSED = {
    "sign": ({"scale": -1.0}, "measures -1.0"), "axis": ({"about": 0.0}, "measures 0.0"),
    "0.8": ({"scale": 0.8}, "measures 0.8"), "0.9": ({"scale": 0.9}, "measures 0.9"),
    "1.1": ({"scale": 1.1}, "measures 1."), "1.2": ({"scale": 1.2}, "measures 1."),
    "stamps 100 ms late": ({"stamped": 0.1}, "s late"), "stamps 200 ms late": ({"stamped": 0.2}, "s late"),
    "stamps 300 ms late": ({"stamped": 0.3}, "s late"), "stamps 100 ms early": ({"stamped": -0.1}, "s late"),
}
SEEDS = [1, pytest.param(6, marks=pytest.mark.long)]


@pytest.mark.parametrize("seeds", SEEDS)
@pytest.mark.parametrize("fault", USED)
def test_what_is_used_leaves_the_heading_within_its_covariance_and_raises_no_alarm(fault, seeds):
    errors = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        wished = rough_noise.joystick(60, rng)
        run = Run().drive(rough_noise.followed(wished), rng, wished=wished, **USED[fault])
        assert not any(run.told)
        errors.append(run.nees)
    assert np.mean(errors) < chi2.ppf(0.995, seeds) / seeds


@pytest.mark.parametrize("seeds", SEEDS)
@pytest.mark.parametrize("fault", REFUSED)
def test_a_gyro_that_is_wrong_is_refused_by_its_reason_and_what_it_gave_is_taken_back(fault, seeds):
    errors = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        wished = rough_noise.joystick(60, rng)
        twists = rough_noise.followed(wished)
        run = Run().drive(twists, rng, wished=wished, **REFUSED[fault][0])
        at = next(index for index, words in enumerate(run.refused) if words)
        assert (np.abs(twists[:at - STANDS, 2]) > 0.2).sum() * PERIOD <= 20.0
        assert REFUSED[fault][1] in run.refused[at]
        assert not any(run.told)
        errors.append(run.nees)
    assert np.mean(errors) < chi2.ppf(0.995, seeds) / seeds


def test_a_unit_of_degrees_is_never_steady_enough_to_learn_a_bias():
    run = Run().drive(np.zeros((600, 3)), np.random.default_rng(1), unit=math.degrees(1.0))
    assert not run.fusion.bias.ready
    assert run.fusion.bias.unsteady > 5.0


@pytest.mark.parametrize("minutes", [4, pytest.param(10, marks=pytest.mark.long)])
@pytest.mark.parametrize("scale", [lambda rng: 1 + rng.normal(0, 0.01), lambda rng: 0.99, lambda rng: 1.01],
                         ids=["scales 1 % off", "1 % too small", "1 % too large"])
def test_the_heading_is_as_good_as_stated(scale, minutes):
    """The mean normalised squared error of the other generator's minutes lies below its upper bound of 99 %."""
    errors = []
    for seed in range(minutes):
        rng, run = np.random.default_rng(seed), Run()
        twists = np.concatenate([np.zeros((STANDS, 3)), other_noise.joystick(60, rng)])
        stamps, rates = other_noise.gyro(twists, rng, scale=scale(rng) - 1)
        run.take(other_noise.counts(THREE, twists, rng, 0.012), (stamps, rates, stamps + 0.005))
        run.truth = path_of(twists)
        errors.append(run.nees)
    assert np.mean(errors) < chi2.ppf(0.995, minutes) / minutes


def test_a_calibrated_gyro_is_better_than_the_wheels():
    rng = np.random.default_rng(1)
    runs = [Run(3e-4).drive(rough_noise.followed(rough_noise.joystick(60, rng)), rng) for _ in range(4)]
    assert math.degrees(np.mean([abs(run.error) for run in runs])) < 0.5


def test_at_rest_the_heading_stays_and_the_bias_is_learnt_though_encoders_flicker():
    rng, twists = np.random.default_rng(1), np.zeros((1500, 3))
    counts = np.diff(rng.integers(-2, 1, (1501, 3)), axis=0)
    run = Run().take(counts, rough_noise.gyro(twists, rng, bias=0.02))
    assert abs(math.degrees(run.poses[-1][2] - run.poses[250][2])) < 0.2
    assert math.sqrt(run.fusion.bias.variance) < 1.5e-4
    assert not any(run.told)


def test_a_robot_that_is_turned_by_hand_is_followed_and_its_bias_kept():
    turns = [(0.0, 4.0), (1.0, 3.5), (-1.0, 3.5), (1.0, 4.0), (0.0, 4.0), (1.0, 1.0), (-0.5, 1.0), (0.0, 3.0)]
    twists = np.concatenate([np.tile((0.0, 0.0, rate), (round(seconds / PERIOD), 1)) for rate, seconds in turns])
    driven = np.arange(len(twists)) < round(15.0 / PERIOD)  # by its wheels first, which agree with the gyro
    rng, run = np.random.default_rng(2), Run()
    counts = rough_noise.counts(THREE, twists * driven[:, None], rng, 0.005)
    run.take(counts, rough_noise.gyro(twists, rng), (twists * driven[:, None] @ UNITS).tolist())
    true = se2.wrap(np.sum(twists[:, 2]) * PERIOD)
    assert abs(se2.wrap(run.poses[-1][2] - true)) < math.radians(35)  # but for the first half second of each turn
    assert not any(run.told[:round(18.5 / PERIOD)])
    assert run.told[round(19.8 / PERIOD)] == (3,), "moved from outside"
    assert run.told[-1] == ()


def test_a_bias_that_jumps_is_learnt_anew():
    rng, run = np.random.default_rng(3), Run()
    stamps, rates, come = rough_noise.gyro(np.zeros((800, 3)), rng, bias=0.0)
    run.take(np.zeros((800, 3)), (stamps, rates + 0.05 * (stamps > 8.0), come))
    assert abs(run.fusion.bias.value - 0.05) < 1e-3
    assert run.fusion.bias.ready


@pytest.mark.parametrize("length", [2, 10, 10000], ids=lambda packets: f"{packets} packets")
def test_unplugged_the_wheels_go_on_without_a_jump(length):
    rng = np.random.default_rng(4)
    twists = np.concatenate([np.zeros((250, 3)), rough_noise.followed(rough_noise.joystick(20, rng))])
    stamps, rates, come = rough_noise.gyro(twists, rng)
    kept = (stamps < 10.0) | (stamps > 10.0 + length * PERIOD)
    run = Run().take(rough_noise.counts(THREE, twists, rng, 0.0), (stamps[kept], rates[kept], come[kept]))
    jumps = np.abs(np.diff(np.array(run.poses) - path_of(twists)[1:], axis=0))[490:]
    assert 1000 * jumps[:, :2].max() < 1.0
    assert np.degrees(np.abs(se2.wrap(jumps[:, 2])).max()) < 0.25


@pytest.mark.parametrize("longest", [0.5, 2.0], ids=lambda seconds: f"stalls of {seconds:g} s")
@pytest.mark.parametrize("seed", [0, 1])
def test_a_machine_that_stalls_loses_no_heading(longest, seed):
    """It turns nearly all the time, and the samples arrive behind all the packets of a stall, each with its stamp."""
    speed, radius = 0.3, 0.25
    circles = np.tile((speed, 0.0, speed / radius), (round(3 * 2 * math.pi * radius / speed / PERIOD), 1))
    twists = np.concatenate([np.zeros((250, 3)), circles, np.zeros((25, 3))])
    rng = np.random.default_rng([seed, 11])
    begins = np.cumsum(rng.uniform(0.2, 2 * longest + 0.2, 200)) + 4.0
    ends = begins + rng.uniform(0, longest, 200)

    def stalled(times):
        out = times.copy()
        for begin, end in zip(begins, ends):
            out[(out >= begin) & (out < end)] = end
        return out
    stamps, rates, come = rough_noise.gyro(twists, rng)
    packets = stalled(PERIOD * np.arange(1, len(twists) + 1) + 0.002)
    run = Run().take(rough_noise.counts(THREE, twists, rng, 0.005), (stamps, rates, stalled(come)),
                     clock=OdometryStamps(PERIOD), arrivals=packets)
    assert math.degrees(abs(se2.wrap(run.poses[-1][2] - path_of(twists)[-1, 2]))) < 1.5


@pytest.mark.parametrize("slipping, twist", [(0, (0.3, 0.0, 0.0)), (1, (0.0, 0.3, 0.0)), (2, (0.3, 0.1, 0.0))], ids=str)
def test_a_wheel_of_three_that_slips_is_told_and_the_gyro_keeps_the_heading(slipping, twist):
    """Half of its part of the motion is not there; both have agreed before, and the noise is learnt."""
    turn, good, slips = (np.tile(each, (round(seconds / PERIOD), 1)) for each, seconds in (
        ((0.0, 0.0, 1.2), 20.0), (twist, 1.0), (twist, 2.0)))
    rng, wished = np.random.default_rng(5), np.concatenate([turn, good, slips])
    ground = slips @ KINEMATICS.matrix.T
    ground[:, slipping] *= 0.5
    moved = np.concatenate([turn, good, ground @ KINEMATICS.inverse.T])
    wished, moved = (np.concatenate([np.zeros((STANDS, 3)), twists]) for twists in (wished, moved))
    counts = rough_noise.counts(THREE, wished, rng, 0.005)
    run = Run().take(counts, rough_noise.gyro(moved, rng), (wished @ UNITS).tolist())
    begins, truth = STANDS + len(turn) + len(good), path_of(moved)[-1]
    assert not any(run.told[:begins])
    assert next(index for index, told in enumerate(run.told[begins:]) if told) * PERIOD <= 0.6
    assert abs(math.degrees(se2.wrap(run.poses[-1][2] - truth[2]))) < 5.0


@pytest.mark.parametrize("stamp", [GAP + 1, -SECOND, 0], ids=["gap", "back", "twice"])
def test_gaps_and_stamps_that_go_back_begin_anew(stamp):
    run = Run()
    run.fusion.add(EPOCH, 1.0)
    run.fusion.add(EPOCH + stamp, 1.0)
    assert run.fusion.gaps == 1
