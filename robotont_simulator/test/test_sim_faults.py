"""What breaks on the simulated robot: the firmware stops it within 0.75 s, and nothing runs away."""

import math
import random

import numpy as np
import pytest
from lockstep import LockstepRun
from robot_runs import run_in, tilt

from robotont_driver.command.command_stream import CommandStream
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_driver.protocol.board_status import DRIVER_FAULT, NO_COUNTS, WRONG_WAY
from robotont_driver.robots.robot_folder import read_robot
from robotont_firmware import config
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World

UNPLUGGED, REVERSED = 0, -1  # states of an encoder
UNIT = 2 * math.pi / 1200 * 50  # [rad/s] of a wheel
CREEP = config.MAX_LOAD / 19.2 + 1  # [units] of a wheel that gets MAX_LOAD and counts nothing


def wheel_speed(simulation, wheel):
    """[rad/s]"""
    return simulation.data.joint(f"wheel{wheel}").qvel[0]


def along(run, wheel, units):
    """The twist straight on along a wheel's direction in which it makes that many units."""
    direction = run.simulation.wheels.directions[wheel]
    speed = units * UNIT * run.simulation.wheels.radii[wheel]
    return speed * math.cos(direction), speed * math.sin(direction), 0.0


def break_encoder(run, wheel, state, twist, within, whole):
    """Drive on with a broken encoder: the wheel is off `within` [s], then all; its fastest speed in `whole` [units]."""
    run.simulation.encoders[wheel] = state
    off, fastest = None, 0.0
    for period in range(round((within + config.BRAKING / 1000 + 0.1) * 50)):  # by then the others have braked
        run.drive([twist])
        fastest = max(fastest, abs(wheel_speed(run.simulation, wheel)) / UNIT)
        if off is None and run.status.wheels[wheel] in (NO_COUNTS, WRONG_WAY):
            off = (period + 1) / 50
    assert off is not None
    assert off <= within
    assert not run.simulation.efforts.any(), "the others have braked"
    return fastest / whole


@pytest.mark.parametrize("wheel, units", [(0, 5), (1, -50), (2, 150)])  # the firmware's suite_faults has them all
@pytest.mark.parametrize("state, fault", [(UNPLUGGED, NO_COUNTS), (REVERSED, WRONG_WAY)])
def test_an_encoder_that_breaks(state, fault, wheel, units):
    for driving in (False, True):
        run = run_in()
        twist = along(run, wheel, units)
        if driving:
            run.hold(twist, 1.5)
        # The set-points take their time; and what a fast wheel does suddenly changes the motion of the robot.
        within = 0.75 if driving and abs(units) < 150 else 0.75 + abs(units) / 500
        assert break_encoder(run, wheel, state, twist, within, abs(units)) <= (abs(units) + CREEP) / abs(units)
        assert run.status.wheels == tuple(fault if other == wheel else 0 for other in range(3))


@pytest.mark.parametrize("mass, slope, seconds", [  # [kg] of the body, [degrees]; 5 kg with wheels on the slope
    (2.0, 0, 20), (5.0, 0, 20), *(pytest.param(*long, 3600, marks=pytest.mark.long) for long in (
        (2.0, 0), (5.0, 0), (3.4, 5), (4.4, 5)))])
def test_driving_behind_the_drivers_limits_is_no_fault(mass, slope, seconds):
    """Mixed driving as people do it; without limits the motors cannot follow, and wheels are reported."""
    robot, rng = read_robot("thesis"), random.Random(int(mass))
    simulation = Simulation(robot.wheels._replace(mass=mass + 3 * WHEEL_MASS), World())
    run = LockstepRun(simulation)  # its LEAD is for that mass
    tilt(run, slope, 0)
    settings = robot.parameters["driver_node"]
    limits = Limits(*(settings.get("max_" + name, 0.0) for name in Limits._fields))
    stream = CommandStream(run.kinematics, limits, 0.5, 0.02)
    while simulation.time < seconds:
        top, turn = rng.choice(((0.05, 0.2), (0.2, 0.8), (0.5, 1.5), (1.0, 2.0)))
        angle, speed = rng.uniform(-math.pi, math.pi), rng.choice((0.0, rng.uniform(0, top)))
        twist = speed * math.cos(angle), speed * math.sin(angle), rng.choice((0.0, rng.uniform(-turn, turn)))
        for _ in range(rng.randint(10, 200)):
            stream.command((*twist[:2], 0.0), (0.0, 0.0, twist[2]), simulation.time)
            run.drive([stream.twist(simulation.time)])
            assert not {DRIVER_FAULT, NO_COUNTS, WRONG_WAY} & set(run.status.wheels), (simulation.time, twist)


def test_starting_uphill_with_all_that_it_may_weigh_is_no_fault():
    """Gravity holds the wheels against what the first rule once took for enough to turn them."""
    wheels = read_robot("thesis").wheels
    run = LockstepRun(Simulation(wheels._replace(mass=4.4 + 3 * WHEEL_MASS), World()))
    for towards in (0, 120):  # a wheel's direction
        tilt(run, 5, towards)
        run.hold((0.0, 0.0, 0.0), 0.7)
        before, way = run.simulation.pose(), math.radians(towards)
        for _ in range(50):
            run.drive([(-0.06 * math.cos(way), -0.06 * math.sin(way), 0.0)])
            assert run.status.fault == ""
        assert math.dist(before[:2], run.simulation.pose()[:2]) == pytest.approx(0.06, abs=0.015)


@pytest.mark.parametrize("state", [UNPLUGGED, REVERSED])
def test_an_encoder_that_breaks_on_a_slow_wheel_beside_fast_ones(state):
    run = run_in()
    twist = (-0.28, 0.52, 0.6)
    units = np.abs(run.kinematics.units_of_twist(twist))
    wheel = int(np.argmin(units))
    assert units[wheel] < max(units) / 5
    run.hold(twist, 1.5)
    assert break_encoder(run, wheel, state, twist, 1.5, max(units)) <= 1.0  # no faster than the fastest should be


MOTORS = [{}, {"motorNoLoadSpeed": 500, "motorStallTorque": 0.08, "gearboxReductionRatio": 10}]


@pytest.mark.parametrize("motor", MOTORS, ids=["37D", "another"])
def test_held_against_a_wall_it_is_told_and_drives_on_after_zeros(motor):
    run = run_in("room", **motor)
    run.hold((-0.4, 0.0, 0.0), 6.0)
    assert NO_COUNTS in run.status.wheels
    run.hold((0.0, 0.0, 0.0), 1.2)
    run.hold((0.3, 0.0, 0.0), 2.0)
    assert run.status.fault == ""
    assert run.simulation.twist()[0] == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize("motor", MOTORS, ids=["37D", "another"])
def test_pushed_at_rest_it_holds_against_and_lifted_it_drives_on_and_both_are_no_fault(motor):
    run = run_in(**motor)
    before, simulation = run.simulation.pose()[0], run.simulation
    for _ in range(100):
        simulation.data.xfrc_applied[simulation._body, 0], simulation._push_ends = 5.0, math.inf  # [N]
        run.drive([(0.0, 0.0, 0.0)])
        assert run.status.fault == ""
    assert abs(simulation.pose()[0] - before) < 0.02
    simulation._push_ends = 0.0
    run.hold((0.3, 0.0, 0.0), 1.0)
    simulation.mujoco_model.opt.gravity[:] = 0.0
    simulation.data.qpos[2] += 0.1
    for _ in range(150):
        run.drive([(0.3, 0.0, 0.0)])
        assert run.status.fault == ""
    speeds = np.array([wheel_speed(simulation, wheel) for wheel in range(3)])
    assert np.abs(speeds * simulation.wheels.radii) == pytest.approx([0.26, 0.0, 0.26], abs=0.01)
