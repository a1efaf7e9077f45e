import math

import numpy as np
import pytest

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import LONGEST_HOLD, NONE, Covariance, Pose, WheelOdometry
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import matrix_of

mpmath = pytest.importorskip("mpmath")  # setup/pypi/test.txt; rosdep has no rule for it
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
    assert odom.wheel_angles == pytest.approx(np.sum(counts, axis=0) * 2 * math.pi / 1200)
    assert odom.wheel_rates == pytest.approx(np.multiply(counts[-1], 2 * math.pi / 1200 / PERIOD))


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
    odom.update(speed, 0.0)
    odom.update((0, 0, 0), 60.0)
    assert odom.pose.x == pytest.approx(0.2 * (0.4 + LONGEST_HOLD)), "it does not drive on through a gap"


def test_covariance_is_propagated_through_the_exact_step():
    """Against the spread of a million-fold disturbed end pose: Jacobians by finite differences."""
    step, start = np.array((0.03, -0.02, 0.4)), (0.5, -0.2, 0.7)
    step_covariance = np.diag((1e-4, 2e-4, 3e-4)) + 2e-5

    def end(pose_and_step):
        pose = Pose()
        pose.resume(pose_and_step[:3], NONE)
        pose.move(pose_and_step[3:])
        return np.array((pose.x, pose.y, pose.yaw))

    at = np.array((*start, *step))
    jacobian = np.column_stack([
        (end(at + 1e-6 * unit) - end(at - 1e-6 * unit)) / 2e-6 for unit in np.eye(6)])
    pose = Pose()
    pose.resume(start, of_matrix(np.diag((1e-3, 2e-3, 5e-3)) - 1e-4))
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = matrix_of(pose.covariance), step_covariance
    pose.move(step.tolist(), of_matrix(step_covariance))
    bent = np.array((*(end(at) - start)[:2], 0.0)) * both[2, 2] / 2  # by the square of the heading's error
    assert matrix_of(pose.covariance) == pytest.approx(
        jacobian @ both @ jacobian.T + 3 * np.outer(bent, bent), abs=1e-10)


def of_matrix(matrix):
    return Covariance(*np.asarray(matrix)[np.triu_indices(3)].tolist())


def test_a_covariance_counts_as_its_matrix():
    generator = np.random.default_rng(1)
    for _ in range(20):
        root, other_root, jacobian = generator.normal(size=(3, 3, 3))
        one, other, vector = root @ root.T, other_root @ other_root.T, generator.normal(size=3)
        jacobian[2, :2] = 0.0
        covariance = of_matrix(one)
        assert np.array_equal(matrix_of(covariance), (one + one.T) / 2)
        assert matrix_of(covariance.plus(of_matrix(other))) == pytest.approx(one + other)
        assert matrix_of(covariance.times(0.3)) == pytest.approx(0.3 * one)
        propagated = covariance.propagated(*jacobian[:2], jacobian[2, 2])
        assert matrix_of(propagated) == pytest.approx(jacobian @ one @ jacobian.T)
        assert matrix_of(Covariance.of_vector(vector)) == pytest.approx(np.outer(vector, vector))
