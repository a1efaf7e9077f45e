"""Other robots in a robot's world, without ROS; rostest_two_robots.py has them with it."""

import math

import numpy as np
import pytest
from lockstep import LockstepRun
from robot_runs import EMPTY

from robotont_description.geometry import robot_radius
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_simulator.simulation import Simulation
from robotont_simulator.surroundings import shared
from robotont_testing.robots import SHIPPED

WHEELS = read_wheels(SHIPPED)


def test_who_is_who():
    for namespace in ("/", "/anything/"):
        assert shared(EMPTY, 1, namespace) == EMPTY
    assert shared(EMPTY, 3, "/robot2/").others == (1, 3)
    for namespace in ("/", "/robot4/", "/robot0/", "/other/"):
        with pytest.raises(ValueError, match=f"found the namespace {namespace} of 3 robots, allowed: robot1 to robot3"):
            shared(EMPTY, 3, namespace)


@pytest.mark.parametrize("start, robot, found", [
    ((1.0, 2.0, 0.0), 3, (1.0, 3.0, 0.0)), ((1.0, 2.0, math.pi / 2), 2, (0.5, 2.0, math.pi / 2))])
def test_they_start_side_by_side(start, robot, found):
    world = shared(EMPTY._replace(start=start), 3, f"/robot{robot}/")
    assert world.start == pytest.approx(found)


def test_it_sees_another_and_is_stopped_by_it():
    run = LockstepRun(Simulation(WHEELS, EMPTY._replace(others=(2, 3))))
    simulation, radius = run.simulation, robot_radius(WHEELS)
    run.hold((0.0, 0.0, 0.0), 0.2)
    assert simulation.scan(np.zeros(1), 0.1, 5.0) == [math.inf]
    simulation.put(2, 1.0, 0.0)
    run.hold((0.0, 0.0, 0.0), 0.1)
    assert simulation.scan(np.zeros(1), 0.1, 5.0) == pytest.approx([1.0 - radius], abs=0.01)
    run.hold((0.4, 0.0, 0.0), 3.0)
    assert simulation.pose()[0] == pytest.approx(1.0 - 2 * radius, abs=0.02)
