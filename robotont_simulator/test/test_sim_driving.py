import math

import numpy as np
import pytest
from robot_runs import run_in

REST = (0.0, 0.0, 0.0)
STANDS = 0.03  # [m/s] slower than this, at the centre and around it, is standing


RAMP = 0.5  # [s] until the speed is reached


def steady(run, twist, seconds):
    """(dx, dy, dyaw) of the truth over `seconds` at full speed, in the frame of its beginning."""
    run.hold(twist, RAMP)
    x0, y0, yaw0 = run.simulation.pose()
    turned = 0.0
    last = yaw0
    for _ in range(round(seconds * 50)):
        yaw = run.hold(twist, 0.02)[1][2]
        turned += math.remainder(yaw - last, 2 * math.pi)
        last = yaw
    x1, y1, _ = run.simulation.pose()
    dx, dy = x1 - x0, y1 - y0
    return math.cos(yaw0) * dx + math.sin(yaw0) * dy, -math.sin(yaw0) * dx + math.cos(yaw0) * dy, turned


@pytest.mark.parametrize("wheels, angle", [(3, 0), (3, 90), (3, 225), (4, 45), (4, 180), (5, 0), (5, 270)])
def test_straight_on_in_every_direction(wheels, angle):
    along = (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    dx, dy, turned = steady(run_in(wheels=wheels), (0.3 * along[0], 0.3 * along[1], 0.0), 5.0)
    distance, drift = along[0] * dx + along[1] * dy, -along[1] * dx + along[0] * dy
    print(f"{angle} deg: {distance:.4f} m, drift {drift:+.4f} m, {math.degrees(turned):+.2f} deg")
    assert distance == pytest.approx(1.5, rel=0.02)
    assert abs(drift) < 0.02 * 1.5
    assert abs(math.degrees(turned)) < 2.0


@pytest.mark.parametrize("wheels, turn", [(3, 1.0), (4, -1.0), (5, -1.0)])
def test_turning_on_the_spot(wheels, turn):
    dx, dy, turned = steady(run_in(wheels=wheels), (0.0, 0.0, turn), 5.0)
    print(f"{turned:.4f} rad, drift {math.hypot(dx, dy):.4f} m")
    assert turned == pytest.approx(5.0 * turn, rel=0.02)
    assert math.hypot(dx, dy) < 0.02


@pytest.mark.parametrize("wheels, twist, seconds", [
    (3, (0.5, 0.0, 0.0), 0.2), (3, (0.5, 0.0, 0.0), 1.2), (3, (0.0, 0.0, 2.0), 1.2), (4, (0.24, -0.24, 1.09), 0.2),
    (4, (0.0, 0.3, -1.0), 1.2), (5, (0.24, -0.24, 1.09), 1.2), (5, (0.0, 0.0, 2.0), 0.2)])
def test_a_stop_is_short_and_the_robot_does_not_swing_back(wheels, twist, seconds):
    run = run_in(wheels=wheels)
    run.hold(twist, seconds)
    moving = 0.0
    for period in range(1, 61):
        run.drive([REST])
        x, y, turn = run.simulation.twist()
        if math.hypot(x, y) + 0.15 * abs(turn) >= STANDS:
            moving = period / 50
    print(f"stands for good {moving:.2f} s after the command")
    assert moving <= 0.4


def test_the_same_seed_gives_the_same_run_and_another_one_other_encoders():
    def play(seed):
        run = run_in(seed=seed)
        run.hold((0.3, -0.1, 0.4), 1.0)
        return run.simulation.pose(), run.counts, list(run.simulation.counts())
    assert play(3) == play(3)
    assert play(3)[2] != play(4)[2]
    assert min(run_in(seed=8).simulation.counts()) > 0, "encoders start anywhere"


def test_a_push_moves_the_truth_and_not_the_odometry():
    run = run_in()
    run.simulation.push(0.0, 3.0)
    odometry, truth = run.hold(REST, 0.3)
    print(f"truth {truth[1]:.3f} m, odometry {odometry[1]:.3f} m")
    assert truth[1] > 0.05
    assert abs(odometry[1]) < 0.1 * truth[1]


def test_a_carried_robot_stands_elsewhere_and_the_odometry_does_not_see_it():
    run = run_in()
    run.simulation.carry(2.0, -1.0, 1.5)
    odometry, truth = run.hold(REST, 0.3)
    assert truth == pytest.approx((2.0, -1.0, 1.5), abs=1e-2)
    assert np.linalg.norm(odometry) < 1e-2


def test_a_visitor_is_seen_and_bars_the_way_until_it_goes():
    run = run_in()
    run.simulation.visit(0.6, 0.0)
    run.hold((0.3, 0.0, 0.0), 1.0)
    assert run.simulation.scan(np.zeros(1), 0.1, 4.0)[0] < 0.5
    assert run.hold((0.3, 0.0, 0.0), 2.0)[1][0] < 0.31
    run.simulation.visit(math.nan, math.nan)
    run.hold(REST, 0.2)  # for which the board waits after a blocked wheel
    assert run.hold((0.3, 0.0, 0.0), 2.0)[1][0] > 0.5
    assert run.simulation.scan(np.zeros(1), 0.1, 4.0)[0] == math.inf


def test_a_sagging_battery_limits_the_speed():
    def reached(voltage):
        run = run_in()
        run.simulation.voltage = voltage
        run.hold((1.0, 0.0, 0.0), 2.0)
        return run.simulation.twist()[0]
    assert reached(12.0) == pytest.approx(1.0, rel=0.05)
    assert reached(5.0) < 0.85


def test_without_commands_the_robot_stops_by_itself():
    run = run_in()
    run.hold((0.4, 0.0, 0.0), 1.5)
    assert run.simulation.twist()[0] > 0.35
    cut = run.simulation.time
    run.drive([None] * 100)  # the board hears nothing
    slow = next(time for (time, _, before), (_, _, after) in zip(run.path, run.path[1:])
                if time > cut and math.dist(before[:2], after[:2]) < 0.02 * 0.05)
    print(f"slower than 0.05 m/s {slow - cut:.2f} s after the last command")
    assert slow - cut <= 0.6
    assert abs(run.simulation.twist()[0]) < 0.01


def test_a_wall_stops_the_robot_and_is_noticed():
    run = run_in("room")
    run.hold((-0.4, 0.0, 0.0), 4.0)
    x, _, _ = run.simulation.pose()
    assert x > 0.05
    assert run.simulation.touches()


def test_the_laser_sees_the_walls_where_they_are():
    run = run_in("room")
    distances = run.simulation.scan(np.radians([0.0, 180.0, -90.0]), 0.1, 20.0)
    assert distances == pytest.approx([2.95, 0.95, 0.95], abs=0.02)
    assert run.simulation.scan(np.radians([0.0, 180.0]), 1.0, 2.0).tolist() == [np.inf, -np.inf], "nothing, too near"


@pytest.mark.parametrize("radius", [0.06, 0.07])
@pytest.mark.parametrize("twist", [(0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.2, -2.0)])
def test_a_healthy_robot_on_larger_wheels_has_no_fault(radius, twist):
    """Its motors feel more of its mass: LEAD, MAX_LOAD and the acceleration of the set-points follow the wheels."""
    run = run_in(wheelRadius=radius)
    run.hold(twist, 2.0)
    assert run.status.wheels == (0, 0, 0)
    assert run.simulation.twist() == pytest.approx(twist, abs=0.1)


@pytest.mark.parametrize("twist, ramp", [((0.0, 0.5, 2.0), 0.0), ((0.8, 0.0, 2.0), 0.0), ((0.3, 0.0, 0.0), 0.4)])
def test_a_healthy_robot_that_bends_its_way_or_starts_slowly_has_no_fault(twist, ramp):
    """The acceleration is no load that only a blocked wheel has."""
    run = run_in()
    for part in np.arange(0.02, ramp, 0.02) / ramp if ramp else ():
        run.hold([part * speed for speed in twist], 0.02)
    run.hold(twist, 3.0)
    x, y, _ = run.simulation.twist()
    assert run.status.wheels == (0, 0, 0)
    assert math.hypot(x - twist[0], y - twist[1]) < 0.05
