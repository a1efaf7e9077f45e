"""A gyro beside the wheels: heading, covariance, bias, gaps, wheels that slip; with readings drawn as a BMI055's."""

import math

import numpy as np
import pytest

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.gyro import Gyro
from robotont_driver.odometry.gyro_fusion import GyroFusion
from robotont_driver.odometry.gyro_samples import GAP, TurnIntegral
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.timing.odometry_stamps import SECOND, OdometryStamps
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, mixed_drive, path_of, rolled, still

NOISE, WALK = 2.5e-4, 1e-5  # [rad/s/sqrt(Hz)], [rad/s/sqrt(s)]
BIAS, SCALE = 0.01, 3e-4    # standard deviations of bias [rad/s] and scale
SAMPLES = 5                 # per period
THREE = read_wheels(SHIPPED)
FALSE_ALARMS = 0.1


class Device:
    """A gyro's readings of true turning speeds, one array of samples per period."""

    def __init__(self, seed, bias=None, scale=None):
        self.random = np.random.default_rng(seed)
        self.bias = BIAS * self.random.standard_normal() if bias is None else bias
        self.scale = 1 + SCALE * self.random.standard_normal() if scale is None else scale

    def read(self, speed):
        """`SAMPLES` readings [rad/s] of a period turned at `speed` [rad/s]."""
        interval = PERIOD / SAMPLES
        self.bias += WALK * math.sqrt(PERIOD) * self.random.standard_normal()
        white = NOISE / math.sqrt(interval) * self.random.standard_normal(SAMPLES)
        return self.scale * speed + self.bias + white


class Run:
    """Odometry of wheels and gyro along true twists."""

    def __init__(self, device=None):
        self.device = device
        self.gyro = Gyro(PERIOD, NOISE, WALK, 1.0, SCALE)
        self.fusion = GyroFusion(self.gyro, FALSE_ALARMS)
        self.odometry = WheelOdometry(Kinematics(THREE), PERIOD, 0.005, self.fusion)
        self.now = 0   # [ns]
        self.poses = []
        self.suspects = []

    def period(self, counts, speed, plugged=True):
        for reading in self.device.read(speed):
            self.now += round(PERIOD * SECOND / SAMPLES)
            if plugged:
                self.fusion.integral.add(self.now, reading)
        self.odometry.update(tuple(counts), 0.0, self.now)
        self.poses.append(pose_of(self.odometry))
        self.suspects.append(self.fusion.watch.suspects if self.fusion.watch else ())

    def turn_by_hand(self, speed, seconds):
        """The wheels stand."""
        for _ in range(round(seconds / PERIOD)):
            self.period((0, 0, 0), speed)

    def drive(self, counts, twists, unplugged=()):
        for number, (packet, twist) in enumerate(zip(counts.tolist(), twists)):
            self.period(packet, twist[2], number not in unplugged)
        return self


def pose_of(odometry):
    return odometry.pose.x, odometry.pose.y, odometry.pose.yaw


def test_at_rest_the_heading_stays_and_the_bias_is_learnt():
    run = Run(Device(1, bias=0.017))
    for number in range(round(30 / PERIOD)):
        flicker = 1 if number % 7 == 0 else -1 if number % 7 == 1 else 0  # an encoder between two edges
        run.period((flicker, 0, 0), 0.0)
    drift = math.degrees(run.poses[-1][2] - run.poses[round(5 / PERIOD)][2])
    assert abs(drift) < 0.03
    assert abs(run.gyro.bias - run.device.bias) < 4 * math.sqrt(run.gyro.bias_variance)
    assert math.sqrt(run.gyro.bias_variance) < 1.5e-4
    assert not any(run.suspects)


def test_a_robot_that_is_turned_by_hand_is_followed_and_its_bias_kept():
    run = Run(Device(2))
    for speed, seconds in ((0.0, 5.0), (1.0, 1.0), (-0.5, 1.0), (0.0, 2.0)):
        run.turn_by_hand(speed, seconds)
    assert math.degrees(abs(run.poses[-1][2] - 0.5)) < 5.0  # but for the first tenths of a second
    assert abs(run.gyro.bias - run.device.bias) < 5e-4
    at_once = round(5.0 / PERIOD)
    assert not any(run.suspects[:at_once])
    assert run.suspects[at_once + 10] == (0, 1, 2)
    assert run.suspects[-1] == ()


def test_a_bias_that_jumps_is_learnt_anew():
    run = Run(Device(3))
    for jump in (0.0, 0.05):
        run.device.bias += jump
        run.turn_by_hand(0.0, 8.0)
    assert abs(run.gyro.bias - run.device.bias) < 1e-3
    assert run.gyro.ready
    assert run.suspects[-1] == ()


@pytest.mark.parametrize("length", [2, 10, 10000], ids=lambda packets: f"{packets} packets")
def test_unplugged_the_wheels_go_on_without_a_jump(length):
    """Against the truth, packet by packet."""
    twists = np.concatenate([still(5.0), mixed_drive(8.0, np.random.default_rng(8)), still(0.5)])
    start = round(8.0 / PERIOD)
    run = Run(Device(4)).drive(counted(THREE, rolled(THREE, twists)), twists, range(start, start + length))
    jumps = np.abs(np.diff(np.array(run.poses) - path_of(twists)[1:], axis=0))[start - 5:]
    assert 1000 * jumps[:, :2].max() < 1.0
    assert np.degrees(np.abs(se2.wrap(jumps[:, 2])).max()) < 0.1
    assert run.fusion.missing > 0


def stalled(times, stalls):
    """[s] arrivals of what was made at `times`, on a machine that does nothing during `stalls`, K x 2 begin and end."""
    arrivals = times + 0.002
    for begin, end in stalls:
        arrivals[(arrivals >= begin) & (arrivals < end)] = end
    return arrivals


@pytest.mark.parametrize("longest", [0.5, 2.0], ids=lambda seconds: f"stalls of {seconds:g} s")
@pytest.mark.parametrize("seed", [0, 1])
def test_a_machine_that_stalls_loses_no_heading(longest, seed):
    """It turns nearly all the time, and the samples arrive behind all the packets of a stall, each with its stamp."""
    speed, radius = 0.3, 0.25
    circles = np.tile((speed, 0.0, speed / radius), (round(3 * 2 * math.pi * radius / speed / PERIOD), 1))
    twists = np.concatenate([still(5.0), circles, still(0.5)])
    counts = counted(THREE, rolled(THREE, twists), 0.005).tolist()
    device, run, clock = Device(seed, scale=1.0), Run(), OdometryStamps(PERIOD)
    readings = np.concatenate([device.read(twist[2]) for twist in twists])
    chance = np.random.default_rng([seed, 11])
    begins = np.cumsum(chance.uniform(0.2, 2 * longest + 0.2, 200)) + 4.0
    stalls = np.column_stack([begins, begins + chance.uniform(0, longest, 200)])
    sampled = PERIOD / SAMPLES * np.arange(1, len(readings) + 1)
    packets = stalled(PERIOD * np.arange(1, len(counts) + 1), stalls)
    events = sorted([(at, 0, number) for number, at in enumerate(packets)]
                    + [(at, 1, number) for number, at in enumerate(stalled(sampled, stalls))])
    for at, is_sample, number in events:
        if is_sample:
            run.fusion.integral.add(round(sampled[number] * SECOND), readings[number])
        else:
            now = round(at * SECOND)
            run.odometry.update(counts[number], 0.0, clock.stamp(now, now))
    assert math.degrees(abs(se2.wrap(run.odometry.pose.yaw - path_of(twists)[-1, 2]))) < 1.5


@pytest.mark.parametrize("slipping, twist", [(0, (0.3, 0.0, 0.0)), (1, (0.0, 0.3, 0.0)), (2, (0.0, 0.0, 1.0))],
                         ids=str)
def test_a_wheel_of_three_that_slips_is_named_within_three_tenths_of_a_second(slipping, twist):
    """It turns as commanded, but half of its part of the motion is not there."""
    good, slips = (np.tile(twist, (round(seconds / PERIOD), 1)) for seconds in (1.0, 2.0))
    ground = rolled(THREE, slips)
    ground[:, slipping] *= 0.5
    moved = (Kinematics(THREE).inverse @ ground.T).T / PERIOD
    twists = np.concatenate([still(3.0), good, moved, still(1.0)])
    counts = counted(THREE, rolled(THREE, np.concatenate([still(3.0), good, slips, still(1.0)])), 0.005)
    run, alone = Run(Device(5)).drive(counts, twists), WheelOdometry(Kinematics(THREE), PERIOD, 0.005)
    for packet in counts.tolist():
        alone.update(packet, 0.0)
    begins = round(4.0 / PERIOD)
    assert not any(run.suspects[:begins])
    named = next(number for number, suspects in enumerate(run.suspects[begins:]) if suspects)
    assert named * PERIOD <= 0.3
    assert slipping in run.suspects[begins + 25]
    off, off_by_wheels = (np.subtract(pose, path_of(twists)[-1]) for pose in (run.poses[-1], pose_of(alone)))
    assert abs(math.degrees(se2.wrap(off[2]))) < 5.0
    assert np.hypot(*off[:2]) < np.hypot(*off_by_wheels[:2])
    assert run.suspects[-1] == ()


def test_samples_that_come_seconds_late_are_made_good_all_the_same():
    integral = TurnIntegral()
    for number in range(10):
        integral.add(number * SECOND // 100, 1.0)
        integral.turned(number * SECOND // 100, 0.005)
    late = [integral.turned(number * SECOND // 100, 0.005) for number in range(10, 210)]
    assert [turn for turn, _ in late[:20]] == pytest.approx([0.005] * 20)
    assert late[40:] == [(None, 0.0)] * 160
    for number in range(10, 211):
        integral.add(number * SECOND // 100, 1.0)
    turn, made_good = integral.turned(210 * SECOND // 100, 0.005)
    assert turn == pytest.approx(0.01)
    assert made_good == pytest.approx(200 * 0.005)
    assert integral.turned(211 * SECOND // 100, 0.005)[1] == 0.0


@pytest.mark.parametrize("stamp", [GAP + 1, -SECOND, 0], ids=["gap", "back", "twice"])
def test_gaps_and_stamps_that_go_back_begin_anew(stamp):
    integral = TurnIntegral()
    integral.add(0, 1.0)
    assert integral.turned(0, 1.0) == (None, 0.0)
    integral.add(stamp, 1.0)
    assert integral.turned(stamp, 1.0) == (None, 0.0)
    assert integral.gaps == 1
    integral.add(stamp + SECOND // 100, 1.0)
    assert integral.turned(stamp + SECOND // 100, 1.0)[0] == pytest.approx(0.01)
