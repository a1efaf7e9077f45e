"""Any encoder, rate and gear: refused with words before it moves, or driven as commanded; and a stop is a stop."""

import math
import sys

import numpy as np
import pytest
from any_robot import CORNERS, SILENCE, SPEEDS, ZEROS, Case, draw
from lockstep import LockstepRun
from robot_runs import EMPTY

from robotont_driver.kinematics.wheel_params import no_load_speeds, read_wheels
from robotont_simulator.simulation import Simulation
from robotont_testing.robots import SHIPPED

REST = (0.0, 0.0, 0.0)
STANDS = 0.02  # [m/s] slower is standing: one turned round by rollers, or by one edge of a coarse encoder
REACH = 0.8    # of the no-load speed: what a robot is asked for
GROWN = 0.6    # [s] from a command until a robot has to be as fast as commanded
MEAN = 0.2     # [s] over which a speed is taken


def drive(case):
    """Drive it: what happened, one word; figures: (fastest, mean speed, [s] until it stands)."""
    folder = {**SHIPPED, "encoderEdgesPerMotorRevolution": case.edges, "pidControlFrequency": case.rate,
              "gearboxReductionRatio": case.gear}
    told = read_wheels(folder)
    true = told._replace(edges_per_motor_turn=max(1, round(case.edges * case.times)))
    speed = min(case.speed, REACH * min(no_load_speeds(told)))
    twist = speed * math.cos(math.radians(case.angle)), speed * math.sin(math.radians(case.angle)), 0.0
    try:
        run = LockstepRun(Simulation(true, EMPTY, case.edges), told)
    except ValueError as error:
        assert "found" in str(error)
        assert "allowed" in str(error)
        return "refused", speed, 0.0, 0.0, 0.0
    speeds, faults = [], set()
    for command, seconds in ((REST, 0.4), (twist, 3.0), (REST if case.zeros else None, 4.0)):
        for _ in range(math.ceil(seconds * case.rate)):
            run.drive([command])
            x, y, turn = run.simulation.twist()
            speeds.append(math.hypot(x, y) + 0.125 * abs(turn) * (command is not twist))
            faults |= {run.status.fault} - {""} if run.status else set()
    first, stop = math.ceil(0.4 * case.rate), math.ceil(0.4 * case.rate) + math.ceil(3.0 * case.rate)
    window = max(1, round(MEAN * case.rate))
    means = np.convolve(speeds, np.ones(window) / window, "valid")
    grown = first + math.ceil((GROWN + speed) * case.rate)
    moving = np.flatnonzero(np.array(speeds[stop:]) > STANDS)
    stands = (moving[-1] + 1) / case.rate if len(moving) else 0.0
    return "fault" if faults else "driven", speed, max(means), float(np.mean(speeds[grown:stop])), stands


def judge(case, word, speed, fastest, mean, stands):
    """What is wrong, in words."""
    faults = []
    if word == "refused":
        return faults
    if case.times >= 1 and fastest > 1.1 * speed:
        faults.append(f"faster than commanded: {fastest:.2f} m/s")
    if case.times == 1 and word == "fault":
        faults.append("fault of a healthy robot")
    if case.times == 1 and abs(mean - speed) > 0.1 * speed:
        faults.append(f"drives {mean:.3f} m/s")
    if stands > np.interp(max(speed, fastest), SPEEDS, ZEROS if case.zeros else SILENCE):
        faults.append(f"stands after {stands:.2f} s")
    return faults


OVER = Case(64, 10, 5.5, 4, 1.0, 90, True)  # braking by such counts would turn it round


@pytest.mark.parametrize("seed", [
    *range(6), 316, 437, OVER, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(6, 240))])
def test_any_robot_drives_as_commanded_and_stops(seed):
    case = seed if seed is OVER else draw(seed)
    found = drive(case)
    print(case, *found)
    assert not judge(case, *found)


@pytest.mark.parametrize("corner", [
    2, 42, 203, 361, *(pytest.param(number, marks=pytest.mark.long) for number in range(len(CORNERS)))])
def test_the_corners(corner):
    assert not judge(CORNERS[corner], *drive(CORNERS[corner]))


LOW_GEAR = {**SHIPPED, "gearboxReductionRatio": 5}


@pytest.mark.parametrize("keys, drives", [
    (LOW_GEAR, False), ({**LOW_GEAR, "motorStallTorque": 0.12}, True), ({**SHIPPED, "robotMass": 25.0}, False),
    ({**SHIPPED, "robotMass": 15.0}, True), ({**LOW_GEAR, "wheelRadius": 0.02}, True)])
def test_a_robot_whose_motors_cannot_brake_it_is_refused(keys, drives):
    wheels = read_wheels(keys)
    try:
        LockstepRun(Simulation(wheels, EMPTY))
    except ValueError as error:
        assert not drives
        assert "config.GEAR: found" in str(error)
        assert "1500 ms at most" in str(error)
    else:
        assert drives


@pytest.mark.parametrize("rate", [999.0, 1000.0])
def test_a_board_faster_than_the_physics_has_a_step_of_it_in_each_period(rate):
    told = read_wheels({**SHIPPED, "pidControlFrequency": rate, "encoderEdgesPerMotorRevolution": 512})
    run = LockstepRun(Simulation(told, EMPTY), told)
    assert run.simulation.mujoco_model.opt.timestep == pytest.approx(1 / rate)
    for _ in range(500):
        run.drive([(0.3, 0.0, 0.0)])
    assert run.simulation.twist()[0] > 0.1


if __name__ == "__main__":
    wrong = 0
    for number in range(*map(int, sys.argv[1:3])):
        that = draw(number)
        result = drive(that)
        complaint = judge(that, *result)
        wrong += bool(complaint)
        print(number, *that, result[0], *(f"{figure:.3f}" for figure in result[1:]), *complaint, flush=True)
    print("wrong:", wrong)
