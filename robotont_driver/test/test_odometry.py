import math

import mpmath
import numpy as np
import pytest

from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.covariance import Covariance
from robotont_driver.odometry.odometry import LONGEST_HOLD, Pose, WheelOdometry
from robotont_testing.robots import SHIPPED

KINEMATICS = Kinematics(read_wheels(SHIPPED))
PERIOD = 0.02


def odometry(period=PERIOD, noise=0.01):
    return WheelOdometry(KINEMATICS, period, noise)


def exact_path(counts):
    """End pose with fifty digits, each arc by its own integral."""
    radians = [mpmath.mpf(rad) + SHIPPED["referenceDirection"] for rad in SHIPPED["wheelRads"]]
    distance = -mpmath.mpf(SHIPPED["wheelDistanceFromCenter"])
    inverse = mpmath.matrix([[mpmath.cos(rad), mpmath.sin(rad), distance] for rad in radians]) ** -1
    edge = 2 * mpmath.pi * mpmath.mpf(SHIPPED["wheelRadius"]) / 1200
    x = y = yaw = mpmath.mpf(0)
    for packet in counts:
        dx, dy, turn = inverse * (mpmath.matrix(packet) * edge)
        sin, cos = mpmath.sin(yaw + turn) - mpmath.sin(yaw), mpmath.cos(yaw) - mpmath.cos(yaw + turn)
        sin, cos = (sin / turn, cos / turn) if turn else (mpmath.cos(yaw), mpmath.sin(yaw))
        x, y, yaw = x + dx * sin - dy * cos, y + dx * cos + dy * sin, yaw + turn
    return float(x), float(y), float(mpmath.fmod(yaw, 2 * mpmath.pi))


@pytest.mark.parametrize("packets", [2000, pytest.param(100_000, marks=pytest.mark.long)])
def test_packets_against_fifty_digits(packets):
    counts = np.random.default_rng(7).integers(-200, 201, size=(packets, 3)).tolist()
    odom = odometry()
    for packet in counts:
        odom.update(packet, 0.0)
    with mpmath.workdps(50):
        x, y, yaw = exact_path(counts)
    errors = abs(odom.pose.x - x), abs(odom.pose.y - y), abs(math.remainder(odom.pose.yaw - yaw, 2 * math.pi))
    assert max(errors) < 1e-11 * packets


def test_counts_are_exact_displacements():
    odom = odometry()
    for _ in range(50):
        odom.update((-1000, 0, 1000), 0.0)
    forward = 50 * 1000 * (2 * math.pi * 0.035 / 1200) / math.cos(math.radians(30))
    assert odom.pose.x == pytest.approx(forward, abs=1e-5)  # the file's angles have seven digits
    assert odom.pose.y == pytest.approx(0, abs=1e-5)
    assert odom.wheel_angles == pytest.approx([-50 * 1000 / 1200 * 2 * math.pi, 0, 50 * 1000 / 1200 * 2 * math.pi])
    assert odom.wheel_rates == pytest.approx([-1000 / 1200 * 2 * math.pi / PERIOD, 0,
                                              1000 / 1200 * 2 * math.pi / PERIOD])


def test_measured_time_holds_each_speed_until_the_next_packet():
    odom = odometry(period=0.0)
    speed = KINEMATICS.units_of_twist((0.2, 0.0, 0.0))
    odom.update(speed, 0.0)
    assert odom.pose.x == 0.0
    assert odom.twist == pytest.approx((0.2, 0, 0), abs=1e-9)
    odom.update(speed, 0.1)
    odom.update((0, 0, 0), 0.3)
    odom.update((0, 0, 0), 1.0)
    assert odom.pose.x == pytest.approx(0.2 * 0.4)


def test_measured_time_does_not_drive_on_through_a_gap():
    odom = odometry(period=0.0)
    odom.update(KINEMATICS.units_of_twist((0.2, 0.0, 0.0)), 0.0)
    odom.update((0, 0, 0), 60.0)
    assert odom.pose.x == pytest.approx(0.2 * LONGEST_HOLD)


def test_covariance_is_propagated_through_the_exact_step():
    """Against the spread of a million-fold disturbed end pose: Jacobians by finite differences."""
    step, start = np.array((0.03, -0.02, 0.4)), (0.5, -0.2, 0.7)
    step_covariance = np.diag((1e-4, 2e-4, 3e-4)) + 2e-5

    def end(pose_and_step):
        pose = Pose()
        pose.x, pose.y, pose.yaw = pose_and_step[:3]
        pose.move(pose_and_step[3:])
        return np.array((pose.x, pose.y, pose.yaw))

    at = np.array((*start, *step))
    jacobian = np.column_stack([
        (end(at + 1e-6 * unit) - end(at - 1e-6 * unit)) / 2e-6 for unit in np.eye(6)])
    pose = Pose()
    pose.x, pose.y, pose.yaw = start
    pose.covariance = Covariance.of_matrix(np.diag((1e-3, 2e-3, 5e-3)) - 1e-4)
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = pose.covariance.matrix, step_covariance
    pose.move(step.tolist(), Covariance.of_matrix(step_covariance))
    assert pose.covariance.matrix == pytest.approx(jacobian @ both @ jacobian.T, abs=1e-10)


def test_covariance_grows_on_the_way_and_rests_at_rest():
    odom = odometry()
    for _ in range(100):
        odom.update((50, -20, 10), 0.0)
    grown = odom.pose.covariance
    assert np.all(np.linalg.eigvalsh(grown.matrix) > 0)
    assert np.trace(grown.matrix) > 1e-6
    odom.update((0, 0, 0), 0.0)
    assert odom.pose.covariance == grown
    assert np.all(np.linalg.eigvalsh(odom.twist_covariance.matrix) > 0)


def test_reset_goes_back_to_the_origin_and_keeps_the_wheels():
    odom = odometry()
    odom.update((50, -20, 10), 0.0)
    angles = odom.wheel_angles
    odom.pose.reset()
    odom.update((0, 0, 0), 0.0)
    assert (odom.pose.x, odom.pose.y, odom.pose.yaw) == (0, 0, 0)
    assert odom.wheel_angles == angles


@pytest.mark.parametrize("angle", [0.0, 1e-9, 9e-5, 1.1e-4, 0.5, -2.0])
def test_derivative_of_sinc(angle):
    expected = mpmath.diff(lambda a: mpmath.sin(a) / a if a else mpmath.mpf(1), mpmath.mpf(angle)) \
        if abs(angle) > 1e-8 else -angle / 3
    assert se2.sinc_derivative(angle) == pytest.approx(float(expected), abs=1e-9)
