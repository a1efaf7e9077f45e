import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import ParameterError, read_wheels
from robotont_driver.protocol.protocol import format_packet
from robotont_testing.robots import BARE, SHIPPED, UNEVEN_4

speeds = st.floats(-3.0, 3.0)


@pytest.mark.parametrize("parameters, twist, packet", [
    (SHIPPED, (0.2, 0, 0), "-18.90:0.00:18.90;\n"),
    (SHIPPED, (0, 0.2, 0), "-10.91:21.83:-10.91;\n"),
    (SHIPPED, (0, 0, 1), "-13.64:-13.64:-13.64;\n"),
    (BARE, (0.2, 0, 0), "10.91:-21.83:10.91;\n"),
    (BARE, (0, 0, 1), "13.64:13.64:13.64;\n"),
])
def test_worked_values(parameters, twist, packet):
    kinematics = Kinematics(read_wheels(parameters))
    assert format_packet(kinematics.units_of_twist(twist), 2) == packet


@given(x=speeds, y=speeds, turn=speeds)
def test_formulas_1_to_3_as_printed(x, y, turn):
    """v_i = R omega + |v| cos(theta_i - phi), with |v| and phi from (2) and (3), in base_link."""
    speed, phi = math.hypot(x, y), math.atan2(y, x)
    printed = [BARE["wheelDistanceFromCenter"] * turn + speed * math.cos(theta - phi)
               for theta in BARE["wheelRads"]]
    assert Kinematics(read_wheels(BARE)).wheel_speeds((x, y, turn)) == pytest.approx(printed, abs=1e-12)


@given(x=speeds, y=speeds, turn=speeds)
def test_a_wheel_drives_along_its_direction_at_its_position(wheels, x, y, turn):
    """From mechanics alone: the rim speed is that of the contact point, v + omega x r, along the wheel."""
    for direction, position, distance, speed in zip(
            wheels.directions, wheels.positions, wheels.distances, Kinematics(wheels).wheel_speeds((x, y, turn))):
        contact = (x - turn * distance * math.sin(position), y + turn * distance * math.cos(position))
        along = contact[0] * math.cos(direction) + contact[1] * math.sin(direction)
        assert speed == pytest.approx(along, abs=1e-12)


@given(
    angles=st.lists(st.floats(0, 2 * math.pi), min_size=3, max_size=8),
    distance=st.floats(0.05, 1.0), radius=st.floats(0.01, 0.3), reference=st.floats(-4, 4),
    rotation=st.sampled_from(["clockwise", "counterclockwise"]), x=speeds, y=speeds, turn=speeds,
)
def test_round_trip_for_any_robot(angles, distance, radius, reference, rotation, x, y, turn):
    try:
        wheels = read_wheels({
            **BARE, "wheelAmount": len(angles), "wheelRads": angles, "wheelDistanceFromCenter": distance,
            "wheelRadius": radius, "referenceDirection": reference, "positiveRotation": rotation})
    except ParameterError:
        assume(False)
    kinematics = Kinematics(wheels)
    twist = kinematics.inverse @ (kinematics.units_of_twist((x, y, turn)) / kinematics.units_per_speed)
    assert twist == pytest.approx((x, y, turn), abs=1e-9)


def test_more_wheels_than_needed_are_averaged_by_least_squares(wheels):
    kinematics = Kinematics(wheels)
    noisy = kinematics.wheel_speeds((0.3, -0.2, 0.5)) + np.linspace(-0.01, 0.02, wheels.amount)
    expected = np.linalg.lstsq(kinematics.matrix, noisy, rcond=None)[0]
    assert kinematics.inverse @ noisy == pytest.approx(expected, abs=1e-12)


def test_excluded_wheels_move_nothing():
    kinematics = Kinematics(read_wheels(UNEVEN_4), excluded=(2,))
    speeds = kinematics.wheel_speeds((0.3, 0.1, 0.5))
    speeds[2] = 0.0
    assert kinematics.inverse @ speeds == pytest.approx((0.3, 0.1, 0.5))
