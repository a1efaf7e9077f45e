"""The numbers that the simulator gives its firmware."""

import pytest

from robotont_driver.robots.robot_folder import read_robot
from robotont_firmware import config
from robotont_simulator.simulated_board import THESIS_INERTIA, THESIS_MASS, configuration


def test_the_thesis_robot_has_those_of_the_firmware():
    numbers = configuration(read_robot("thesis").wheels, THESIS_MASS, THESIS_INERTIA)
    for name in ("LEAD", "TURN_LEAD", "MAX_LOAD", "BLOCKED_INTEGRAL", "ARC"):
        assert getattr(numbers, name) == pytest.approx(getattr(config, name), rel=0.002), name
