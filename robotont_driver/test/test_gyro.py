"""A gyro beside the wheels: heading, covariance, bias, gaps, wheels that slip, and 23 ways in which it may be wrong."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes.odom_node import GYRO_BIAS_DRIFT, GYRO_SCALE_NOISE, PARAMETERS
from robotont_driver.odometry.gyro import GAP, Gyro
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.odometry_stamps import SECOND, OdometryStamps
from robotont_driver.odometry.slip import SlipSearch
from robotont_testing import physics
from robotont_testing.simulated_wheels import matrix_of

PERIOD, BASE = 0.02, physics.Base(3)
KINEMATICS = Kinematics(read_wheels(BASE.thesis_keys()))
UNITS = BASE.matrix.T / BASE.edge * PERIOD  # per m/s
DEFAULTS = {parameter.name: parameter.default for parameter in PARAMETERS}
STANDS = 125  # packets before each drive
EPOCH = 10 ** 18  # [ns]


class Run:
    """Odometry as odom_node makes it, of a robot that stands for 2.5 s first."""

    def __init__(self, scale_noise=GYRO_SCALE_NOISE):
        self.gyro = Gyro(PERIOD, KINEMATICS.wheels.metres_per_edge, DEFAULTS["gyro_noise"], GYRO_BIAS_DRIFT, 1.0,
                         scale_noise)
        self.search = SlipSearch(KINEMATICS, PERIOD, DEFAULTS["wheel_noise"], DEFAULTS["slip_limit"])
        self.odometry = WheelOdometry(KINEMATICS, PERIOD, DEFAULTS["wheel_noise"], self.gyro)
        self.poses, self.told, self.words = [], [], []

    def take(self, counts, samples, commanded=None, clock=None, arrivals=None):
        """Take K packets at their time, and (arrivals, stamps, rates) of a gyro [s] as they come."""
        waiting = list(zip(*[part.tolist() for part in samples]))[::-1]
        for index, packet in enumerate(counts.tolist()):
            now = (index + 1) * PERIOD + 0.004 if arrivals is None else arrivals[index]
            while waiting and waiting[-1][0] <= now:
                come, stamp, rates = waiting.pop()
                self.gyro.add(EPOCH + round(stamp * SECOND), rates[2], EPOCH + round(come * SECOND))
            at = EPOCH + round(now * SECOND)
            stamp = EPOCH + round((index + 1) * PERIOD * SECOND) if clock is None else clock.stamp(at, at)
            self.odometry.update(packet, 0.0, stamp, self.search.slips)
            self.search.update(packet, None if commanded is None else commanded[index], self.gyro.compared)
            pose = self.odometry.pose
            self.poses.append((pose.x, pose.y, pose.yaw))
            self.told.append(self.search.alike)
            self.words.append(self.gyro.words(at))
        return self

    def drive(self, rng, seconds=90.0, noise=0.012, fault=None, lag=0.06):
        """A drive by hand, and the truth of it."""
        wished = np.concatenate([np.zeros((1, STANDS, 3)), physics.commands(rng, 1, seconds)], axis=1)
        self.twists = physics.behind(wished, lag / 2, lag / 2)
        counts = physics.encoders(rng, BASE, self.twists, noise)[0]
        return self.take(counts, physics.gyro(rng, self.truth[:, 2], fault=fault), (wished[0] @ UNITS).tolist())

    @property
    def truth(self):
        """True poses."""
        return physics.true_poses(self.twists)[0]

    @property
    def error(self):
        """Of the pose at the end [m, m, rad]."""
        x, y, yaw = np.subtract(self.poses[-1], self.truth[-1])
        return np.array((x, y, se2.wrap(yaw)))

    @property
    def nees(self):
        """Normalised squared error of the pose."""
        return self.error @ np.linalg.solve(matrix_of(self.odometry.pose_covariance), self.error)

    @property
    def turned_until_refused(self):
        """[s] of turning until words told why it is not used; infinite: it was used."""
        turning = np.cumsum(np.abs(self.twists[0, :, 2]) > 0.2) * PERIOD
        return next((turning[at] for at, words in enumerate(self.words) if words and at > STANDS), math.inf)


WORDS = {
    "sign": "measures -", "axis x": "measures 0.0", "axis y": "measures 0.0", "degrees": "turns for one of",
    "radians as degrees": "measures 0.0", "zeros": "measures 0.0", "scale 0.8": "measures 0.8",
    "scale 0.9": "measures 0.9", "scale 1.1": "measures 1.", "scale 1.2": "measures 1.",
    "another machine's clock": "s behind this computer's clock",
    "a clock ahead": "s ahead of this computer's clock", "9 Hz": "s apart", "not a number": "no finite numbers"}


ALSO = ("axis x", "axis y", "radians as degrees", "scale 0.9", "scale 1.1", "scale 1.2", "clock 100 ppm",
        "late 0 to 300 ms", "late 300 ms")  # like others of the short run


@pytest.mark.parametrize("fault, seeds", [
    *((fault, 1) for fault in physics.GYRO_FAULTS if fault not in ALSO),
    *(pytest.param(fault, 6, marks=pytest.mark.long) for fault in physics.GYRO_FAULTS)])
def test_a_gyro_is_refused_by_its_reason_or_leaves_the_pose_within_its_covariance(fault, seeds):
    seconds = 60.0 if seeds == 1 else 90.0
    runs = [Run().drive(np.random.default_rng([seed, 1]), seconds, fault=physics.GYRO_FAULTS[fault])
            for seed in range(100, 100 + seeds)]
    assert not any(told for run in runs for told in run.told)
    refused, nees = [run.turned_until_refused for run in runs], np.mean([run.nees for run in runs])
    print(f"{fault}: refused after {min(refused):.1f} to {max(refused):.1f} s of turning, squared error {nees:.2f}")
    if fault == "sign":
        assert all(run.gyro.agreement.error == pytest.approx(-2.0, abs=0.02) for run in runs)
    if fault in WORDS:
        assert max(refused) <= 20.0
        assert all(any(WORDS[fault] in words for words in run.words) for run in runs)
    else:
        assert nees < chi2.ppf(0.99, 3 * seeds) / seeds


@pytest.mark.parametrize("moves", [(0.3, 0.0, 0.0), (0.0, 0.0, 0.0)], ids=["straight on", "at rest"])
def test_a_gyro_is_judged_by_the_way_turned_however_seldom_the_robot_turns(moves):
    turn = [np.tile(twist, (round(seconds / PERIOD), 1)) for twist, seconds in ((moves, 30.0), ((0.0, 0.0, 1.0), 1.57))]
    wished, rng, run = np.concatenate([np.zeros((STANDS, 3)), *3 * turn])[None], np.random.default_rng(1), Run()
    run.twists = physics.behind(wished, 0.03, 0.03)
    counts = physics.encoders(rng, BASE, run.twists, 0.005)[0]
    run.take(counts, physics.gyro(rng, run.truth[:, 2], fault={"scale": -1}), (wished[0] @ UNITS).tolist())
    assert "measures -1.0" in run.words[-1]


def test_a_unit_of_degrees_is_never_steady_enough_to_learn_a_bias():
    run = Run()
    run.take(np.zeros((600, 3)), physics.gyro(np.random.default_rng(1), np.zeros(600), sigma=0.2))
    assert "not steady" in run.words[-1]


def test_a_gyro_is_better_than_the_wheels():
    runs = [Run().drive(np.random.default_rng(seed), 60.0) for seed in range(2)]
    assert math.degrees(np.mean([abs(run.error[2]) for run in runs])) < 0.6
    assert not any(run.words[-1] for run in runs)


def test_at_rest_the_heading_stays_and_the_bias_is_learnt_though_encoders_flicker():
    rng = np.random.default_rng(1)
    counts = np.diff(rng.integers(-2, 1, (1501, 3)), axis=0)
    run = Run().take(counts, physics.gyro(rng, np.zeros(1500), bias=0.03))
    assert abs(math.degrees(run.poses[-1][2] - run.poses[250][2])) < 0.2
    assert math.sqrt(run.gyro.bias.variance) < 1.5e-4
    assert not any(run.told)


def test_a_robot_that_is_turned_by_hand_is_followed_and_its_bias_kept():
    turns = [(0.0, 4.0), (1.0, 3.5), (-1.0, 3.5), (1.0, 4.0), (0.0, 4.0), (1.0, 1.0), (-0.5, 1.0), (0.0, 3.0)]
    rates = np.concatenate([np.full(round(seconds / PERIOD), rate) for rate, seconds in turns])
    twists = rates[None, :, None] * (0.0, 0.0, 1.0)
    driven = twists * (np.arange(twists.shape[1]) < round(15.0 / PERIOD))[:, None]  # by its wheels first, which agree
    rng, run = np.random.default_rng(2), Run()
    run.twists = twists
    counts = physics.encoders(rng, BASE, driven, 0.005)[0]
    run.take(counts, physics.gyro(rng, run.truth[:, 2]), (driven[0] @ UNITS).tolist())
    assert abs(run.error[2]) < math.radians(35)  # but for the first second of each turn
    assert not any(run.told[:round(18.5 / PERIOD)])
    assert run.told[round(19.8 / PERIOD)] == (3,), "moved from outside"
    assert run.told[-1] == ()


@pytest.mark.parametrize("period", [0.02, 0.0215, 0.025], ids=lambda period: f"packets each {1000 * period:g} ms")
def test_before_any_drive_a_turn_by_hand_is_followed_though_the_board_is_slow(period):
    run, clock, turning = Run(), OdometryStamps(PERIOD), 4.0
    for now in np.arange(period, turning + 2.0, period).tolist():
        at = EPOCH + round(now * SECOND)
        run.gyro.add(at, 0.01 + (now > turning), at)
        run.odometry.update((0, 0, 0), 0.0, clock.stamp(at, at), run.search.slips)
        run.search.update((0, 0, 0), None, run.gyro.compared)
    assert run.odometry.pose.yaw > 0.5


def test_a_robot_that_settles_slowly_behind_a_turn_is_not_taken_for_a_bias():
    """As our firmware's in the simulator, which holds its place: behind a spin it goes back, ever slower."""
    settles = -np.radians(np.interp(np.arange(0.0, 2.5, PERIOD), (0.0, 0.75, 1.5, 2.5), (2.0, 0.44, 0.19, 0.04)))
    rates = np.concatenate([np.zeros(2 * STANDS), *5 * [np.ones(250), settles]])
    rng, run = np.random.default_rng(4), Run(scale_noise=3e-4)
    run.twists = rates[None, :, None] * (0.0, 0.0, 1.0)
    run.take(physics.encoders(rng, BASE, run.twists, 0.001)[0], physics.gyro(rng, run.truth[:, 2], bias=0.0))
    assert abs(math.degrees(run.gyro.bias.value)) < 0.05
    assert run.nees < chi2.ppf(0.99, 3)


def test_a_bias_that_jumps_is_learnt_anew():
    run = Run()
    come, stamps, rates = physics.gyro(np.random.default_rng(3), np.zeros(800), bias=0.0)
    run.take(np.zeros((800, 3)), (come, stamps, rates + 0.05 * (stamps > 8.0)[:, None]))
    assert abs(run.gyro.bias.value - 0.05) < 1e-3
    assert not run.words[-1]


@pytest.mark.parametrize("length", [2, 10, 10000], ids=lambda packets: f"{packets} packets")
def test_unplugged_the_wheels_go_on_without_a_jump(length):
    rng, run = np.random.default_rng(4), Run()
    run.twists = np.concatenate([np.zeros((1, 250, 3)), physics.commands(rng, 1, 20.0)], axis=1)
    samples = physics.gyro(rng, run.truth[:, 2])
    kept = (samples[1] < 10.0) | (samples[1] > 10.0 + length * PERIOD)
    run.take(physics.encoders(rng, BASE, run.twists)[0], [part[kept] for part in samples])
    jumps = np.abs(np.diff(np.array(run.poses) - run.truth, axis=0))[490:]
    assert 1000 * jumps[:, :2].max() < 1.0
    assert np.degrees(np.abs(se2.wrap(jumps[:, 2])).max()) < 0.25


@pytest.mark.parametrize("rate", [250.0, -1000.0, 1e16, 1e300])
def test_one_absurd_sample_is_no_turn(rate):
    rng, run = np.random.default_rng(5), Run()
    run.twists = np.concatenate([np.zeros((1, STANDS, 3)), physics.commands(rng, 1, 10.0)], axis=1)
    come, stamps, rates = physics.gyro(rng, run.truth[:, 2])
    rates[round(0.8 * len(rates))] = rate
    run.take(physics.encoders(rng, BASE, run.twists)[0], (come, stamps, rates))
    assert abs(run.error[2]) < math.radians(2)


@pytest.mark.parametrize("longest", [0.5, 2.0], ids=lambda seconds: f"stalls of {seconds:g} s")
def test_a_machine_that_stalls_loses_no_heading(longest):
    """It turns nearly all the time, and the samples arrive behind all the packets of a stall, each with its stamp."""
    rng, run = np.random.default_rng(11), Run()
    run.twists = np.tile((0.3, 0.0, 1.2), (1, 1075, 1))
    run.twists[:, :250] = run.twists[:, -25:] = 0.0
    begins = np.cumsum(rng.uniform(0.2, 2 * longest + 0.2, 200)) + 4.0
    ends = begins + rng.uniform(0, longest, 200)

    def stalled(times):
        out = times.copy()
        for begin, end in zip(begins, ends):
            out[(out >= begin) & (out < end)] = end
        return out
    come, *samples = physics.gyro(rng, run.truth[:, 2])
    packets = stalled(PERIOD * np.arange(1, run.twists.shape[1] + 1) + 0.002)
    run.take(physics.encoders(rng, BASE, run.twists, 0.005)[0], (stalled(come), *samples), clock=OdometryStamps(PERIOD),
             arrivals=packets)
    assert math.degrees(abs(run.error[2])) < 1.5


@pytest.mark.parametrize("slipping, twist", [(0, (0.3, 0.0, 0.0)), (1, (0.0, 0.3, 0.0)), (2, (0.3, 0.1, 0.0))], ids=str)
def test_a_wheel_of_three_that_slips_is_told_and_the_gyro_keeps_the_heading(slipping, twist):
    """Half of its part of the motion is not there; both have agreed before, and the noise is learnt."""
    still, turn, good, slips = (np.tile(each, (round(seconds / PERIOD), 1)) for each, seconds in (
        ((0.0, 0.0, 0.0), 2.5), ((0.0, 0.0, 1.2), 20.0), (twist, 1.0), (twist, 2.0)))
    ground = slips @ BASE.matrix.T
    slipping = int(np.argmax(np.abs(ground[0]))) if abs(ground[0, slipping]) < 0.1 else slipping
    ground[:, slipping] *= 0.5
    rng, run = np.random.default_rng(5), Run()
    wished = np.concatenate([still, turn, good, slips])
    run.twists = np.concatenate([still, turn, good, ground @ np.linalg.inv(BASE.matrix).T])[None]
    counts = physics.encoders(rng, BASE, wished[None], 0.005)[0]
    run.take(counts, physics.gyro(rng, run.truth[:, 2]), (wished @ UNITS).tolist())
    begins = len(wished) - len(slips)
    assert not any(run.told[:begins])
    assert next(index for index, told in enumerate(run.told[begins:]) if told) * PERIOD <= 0.6
    assert abs(math.degrees(run.error[2])) < 5.0


@pytest.mark.parametrize("apart", [GAP + 0.001, -1.0, 0.0], ids=["gap", "back", "twice"])
def test_gaps_and_stamps_that_go_back_begin_anew(apart):
    gyro = Run().gyro
    gyro.add(EPOCH, 1.0, EPOCH)
    gyro.add(EPOCH + round(apart * SECOND), 1.0, EPOCH + SECOND // 10)
    assert gyro.gaps == 1
