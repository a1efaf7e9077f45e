import math

import numpy as np
import pytest
from robot_runs import run_in, tilt

from robotont_driver.kinematics.se2 import between
from robotont_testing.simulated_wheels import touches

REST = (0.0, 0.0, 0.0)
STANDS = 0.03  # [m/s] slower than this, at the centre and around it, is standing
RAMP = 0.5  # [s] until the speed is reached


@pytest.mark.parametrize("wheels, twist", [
    *((wheels, (0.3 * math.cos(math.radians(angle)), 0.3 * math.sin(math.radians(angle)), 0.0))
      for wheels, angle in ((3, 0), (3, 225), (4, 45), (5, 270))), (3, (0.0, 0.0, 1.0)), (4, (0.0, 0.0, -1.0))])
def test_straight_on_in_every_direction_and_on_the_spot(wheels, twist):
    run = run_in(wheels=wheels)
    run.hold(twist, RAMP)
    first = len(run.path) - 1
    run.hold(twist, 5.0)
    truth = np.array([pose for _, _, pose in run.path[first:]])
    x, y, _ = between(truth[0], truth[-1])
    turned = np.unwrap(truth[:, 2])[-1] - truth[0, 2]
    print(f"{wheels} wheels, {twist}: {math.hypot(x, y):.4f} m, {turned:.4f} rad = {math.degrees(turned):.2f} degrees")
    assert math.hypot(x - 5 * twist[0], y - 5 * twist[1]) < 0.02
    assert abs(turned - 5 * twist[2]) < math.radians(2.0)


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


def test_wheels_that_rest_on_an_edge_do_not_count_to_and_fro():
    run = run_in()
    run.hold(REST, 3.0)
    assert not np.any(run.counts[-100:]), run.counts[-100:]


def test_the_same_seed_gives_the_same_run_and_another_one_other_encoders():
    def play(seed):
        run = run_in(seed=seed)
        run.hold((0.3, -0.1, 0.4), 1.0)
        return run.simulation.pose(), run.counts, list(run.simulation.counters)
    assert play(3) == play(3)
    assert play(3)[2] != play(4)[2]
    assert min(run_in(seed=8).simulation.counters) > 0, "encoders start anywhere"


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
    run.simulation.put(0, 0.6, 0.0)
    run.hold((0.3, 0.0, 0.0), 1.0)
    assert run.simulation.scan(np.zeros(1), 0.1, 4.0)[0] < 0.5
    assert run.hold((0.3, 0.0, 0.0), 2.0)[1][0] < 0.31
    run.simulation.put(0, math.nan, math.nan)
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


@pytest.mark.parametrize("towards", [75, *(pytest.param(towards, marks=pytest.mark.long) for towards in (0, 200))])
def test_a_wheel_that_makes_an_edge_now_and_then_on_a_slope_is_no_fault(towards):
    """It gets what the slope takes all the time."""
    run = run_in()
    tilt(run, 5, towards)
    for _ in range(10):
        for turn in (-0.02, 0.01):
            run.hold((0.0, 0.0, turn), 1.0)
            assert run.status.fault == ""


@pytest.mark.parametrize("slope, towards, most", [
    (5, 75, 10), (8, 200, 80),
    *(pytest.param(slope, towards, most, marks=pytest.mark.long) for slope, towards, most in (
        (3, 0, 10), (3, 75, 10), (3, 200, 10), (5, 0, 10), (5, 200, 10), (8, 0, 80), (8, 75, 80)))])
@pytest.mark.parametrize("seconds", [15.0, pytest.param(60.0, marks=pytest.mark.long)])
def test_a_robot_that_is_told_to_stand_stands_on_a_slope(slope, towards, most, seconds):
    """For a minute [mm]; on 8 degrees it creeps, a quarter of that in a quarter of a minute."""
    run = run_in()
    tilt(run, slope, towards)
    start = len(run.path)
    run.hold((0.0, 0.0, 0.0), seconds)
    steps = np.diff([truth[:2] for _, _, truth in run.path[start:]], axis=0)
    assert 1000 * np.linalg.norm(steps.sum(axis=0)) <= max(10, most * seconds / 60)
    assert np.linalg.norm(steps, axis=1).max() <= 0.1 * 0.02
    assert run.status.fault == ""


def test_a_wall_stops_the_robot_and_is_noticed():
    run = run_in("room")
    before = run.simulation.time
    while run.status.fault == "" and run.simulation.time < before + 4.0:
        run.drive([(-0.4, 0.0, 0.0)])
    assert run.status.fault
    assert touches(run.simulation)
    assert run.simulation.pose()[0] > 0.05


def test_the_laser_sees_the_walls_where_they_are():
    run = run_in("room")
    distances = run.simulation.scan(np.radians([0.0, 180.0, -90.0]), 0.1, 20.0)
    assert distances == pytest.approx([2.95, 0.95, 0.95], abs=0.02)
    assert run.simulation.scan(np.radians([0.0, 180.0]), 1.0, 2.0).tolist() == [np.inf, -np.inf], "nothing, too near"


@pytest.mark.parametrize("twist, ramp, robot", [
    # the motors feel more of its mass: LEAD, MAX_LOAD and the acceleration of the set-points follow the wheels
    *((twist, 0.0, {"wheelRadius": radius}) for radius in (0.06, 0.07)
      for twist in ((0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.2, -2.0))),
    # the acceleration of a bend and of a slow start is no load that only a blocked wheel has
    ((0.0, 0.5, 2.0), 0.0, {}), ((0.8, 0.0, 2.0), 0.0, {}), ((0.3, 0.0, 0.0), 0.4, {}),
    # one wheel may hardly have to turn, while the fast ones load it sideways and drag it
    ((-0.49, 0.16, 1.92), 0.0, {}), ((0.44, 0.5, 1.09), 0.0, {}), ((0.47, 0.36, -1.52), 0.0, {"wheels": 4}),
    ((-0.12, 0.38, -0.95), 0.0, {"wheels": 5})])
def test_a_healthy_robot_has_no_fault(twist, ramp, robot):
    run = run_in(**robot)
    for part in np.arange(0.02, ramp, 0.02) / ramp if ramp else ():
        run.hold([part * speed for speed in twist], 0.02)
    run.hold(twist, 3.0)
    x, y, turn = run.simulation.twist()
    assert not any(run.status.wheels)
    assert math.hypot(x - twist[0], y - twist[1]) < 0.05
    assert turn == pytest.approx(twist[2], abs=0.1)
