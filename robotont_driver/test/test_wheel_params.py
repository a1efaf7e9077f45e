import math

import pytest

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import (
    MOST_WHEELS,
    Motor,
    counts_in_reach,
    doubts,
    no_load_speeds,
    read_wheels,
)
from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.protocol.checked import add_checksum
from robotont_driver.protocol.protocol import LONGEST_LINE, format_packet
from robotont_driver.robots.robot_folder import read_wheel_file
from robotont_testing.robots import BARE, SHIPPED, WHEEL_PARAMS


def faults_of(given):
    with pytest.raises(ParameterError) as raised:
        read_wheels(given)
    return raised.value.faults


def test_shipped_wheels_stand_where_their_angles_say():
    positions = read_wheels(SHIPPED).positions
    expected = [math.remainder(rad, 2 * math.pi) for rad in SHIPPED["wheelRads"]]
    assert [math.remainder(position, 2 * math.pi) for position in positions] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("key, value", [
    ("wheelAmount", 2), ("wheelAmount", "3"), ("wheelAmount", True), ("wheelAmount", None),
    ("wheelAmount", 4), ("wheelAmount", -3), ("wheelAmount", 17), ("wheelAmount", 2147483647),
    ("wheelRads", [0.0, 1.0]), ("wheelRads", [0.0, 1.0, "x"]), ("wheelRads", [0.0, 1.0, math.nan]),
    ("wheelRads", 1.0), ("wheelRads", [0.0, 2.0, math.inf]), ("wheelRads", []), ("wheelRads", {}),
    ("wheelRads", [0.0, 2.0, 1e300]),
    ("wheelRads", [0.0, 0.0, 0.0]), ("wheelRads", [1.0, 1.0 + math.pi, 1.0]),
    ("wheelDistanceFromCenter", 0), ("wheelDistanceFromCenter", [0.1, 0.1]),
    ("wheelDistanceFromCenter", [0.1, 0.1, -0.1]), ("wheelDistanceFromCenter", "0.125"),
    ("wheelRadius", -0.035), ("wheelRadius", math.nan), ("wheelRadius", math.inf), ("wheelRadius", True),
    ("wheelRadius", 35), ("wheelDistanceFromCenter", 125),  # millimetres
    ("wheelRadius", 1e-300), ("wheelDistanceFromCenter", 1e-300), ("gearboxReductionRatio", 1e-300),
    ("wheelRadius", 0.35),  # where there is room for 0.25
    ("gearboxReductionRatio", 1e300), ("encoderEdgesPerMotorRevolution", 10 ** 9), ("pidControlFrequency", 1e9),
    ("pidControlFrequency", 1e-300),
    ("gearboxReductionRatio", 0.0), ("gearboxReductionRatio", [18.75]),
    ("encoderEdgesPerMotorRevolution", 64.5), ("encoderEdgesPerMotorRevolution", 0),
    ("pidControlFrequency", 0), ("pidControlFrequency", "50 Hz"),
    ("referenceDirection", "right"), ("referenceDirection", math.nan), ("referenceDirection", None),
    ("positiveRotation", "left"), ("positiveRotation", 1), ("positiveRotation", []),
    ("positiveRotation", ["clockwise", "clockwise"]), ("positiveRotation", ["clockwise", "clockwise", 1]),
    ("encoderEdgesPerMotorRevolution", 2 ** 20 + 1), ("encoderEdgesPerMotorRevolution", math.inf),
    ("wheelPositionRads", [0.0, 1.0]), ("wheelPositionRads", [0.0, 1.0, 90.0]), ("wheelPositionRads", None),
    ("motorNoLoadSpeed", 0.0), ("motorNoLoadSpeed", 18000), ("motorStallTorque", -1.0), ("motorRotorInertia", "2e-6"),
    ("robotMass", 0), ("robotMass", math.nan),
])
def test_a_wrong_value_is_named_with_what_was_found(key, value):
    faults = faults_of({**SHIPPED, key: value})
    named = [fault for fault in faults if fault.startswith(key + ":")]
    if (key, value) == ("wheelAmount", 4):  # the amount is allowed; then the list is too short
        named = [fault for fault in faults if fault.startswith("wheelRads:")]
        value = SHIPPED["wheelRads"]
    assert len(named) == 1
    assert f"found {value!r}, allowed: " in named[0]


def test_wheels_that_stand_apart_from_their_direction_need_no_sign():
    given = {**SHIPPED, "wheelPositionRads": SHIPPED["wheelRads"]}
    assert faults_of(given) == ["positiveRotation: found 'clockwise', allowed: nothing beside wheelPositionRads, which "
                                "tells where each wheel stands"]


def test_a_sign_per_wheel_is_a_motor_mounted_the_other_way_round():
    """The same robot: wheel 0 drives the other way when it turns positive."""
    one = {**BARE, "wheelRads": [math.radians(angle) for angle in (90, 210, 330)]}
    mirrored = {**BARE, "wheelRads": [math.radians(angle) for angle in (270, 210, 330)],
                "positiveRotation": ["clockwise", "counterclockwise", "counterclockwise"]}
    for twist in ((0.3, -0.2, 1.0), (0.0, 0.0, 1.0)):
        ahead, same_left, same_right = Kinematics(read_wheels(one)).wheel_speeds(twist)
        assert Kinematics(read_wheels(mirrored)).wheel_speeds(twist) == pytest.approx([-ahead, same_left, same_right])
    assert read_wheels(mirrored).positions == pytest.approx(
        [position + 2 * math.pi * (wheel == 0) for wheel, position in enumerate(read_wheels(one).positions)])
    assert not doubts(read_wheels(mirrored))
    assert not doubts(read_wheels(SHIPPED))
    assert doubts(read_wheels({**SHIPPED, "wheelRadius": 1.38, "wheelDistanceFromCenter": 4.92})) == (  # inches
        "wheelRadius, gearboxReductionRatio, motorNoLoadSpeed: the wheels reach 72.3 m/s without load, expected: "
        "0.02 to 20.0")
    twice = {**BARE, "wheelAmount": 4, "wheelRads": [0.0, 2.0, 4.0, 4.0]}
    assert doubts(read_wheels(twice)).startswith("wheelRads: wheels 2 and 3 would stand at one place, 139 degrees")
    assert not doubts(read_wheels({**twice, "wheelDistanceFromCenter": [0.1, 0.1, 0.1, 0.2]}))
    del mirrored["positiveRotation"]
    assert doubts(read_wheels(mirrored)).startswith(
        "wheelRads: all wheels stand on one side of the centre, at 180, 120, 240 degrees")


def test_whole_numbers_may_be_written_as_floats():
    as_floats = read_wheels({**SHIPPED, "wheelAmount": 3.0, "encoderEdgesPerMotorRevolution": 64.0})
    assert as_floats == read_wheels(SHIPPED)
    assert isinstance(as_floats.edges_per_motor_turn, int)


def test_a_motor_of_which_the_speed_alone_is_known_is_the_default_one_behind_a_gearbox():
    """So a hub motor is as strong at the wheel as the shipped robot's motor with its gearbox."""
    hub = read_wheels({**SHIPPED, "gearboxReductionRatio": 1.0, "motorNoLoadSpeed": Motor().no_load_speed / 18.75})
    shipped = read_wheels(SHIPPED)
    assert no_load_speeds(hub) == pytest.approx(no_load_speeds(shipped))
    assert no_load_speeds(shipped) == pytest.approx([1.8326] * 3, abs=1e-4)
    for key, power in (("stall_torque", 1), ("rotor_inertia", 2)):
        assert getattr(hub.motor, key) == pytest.approx(getattr(shipped.motor, key) * 18.75 ** power)
    told = read_wheels({**SHIPPED, "motorNoLoadSpeed": 300.0, "motorStallTorque": 0.5, "motorRotorInertia": 1e-5,
                        "robotMass": 12.0})
    assert (told.motor, told.mass) == (Motor(300.0, 0.5, 1e-5), 12.0)


@pytest.mark.parametrize("gear, edges, frequency, rpm", [
    (18.75, 64, 50, 9375),      # Pololu 37D
    (1.0, 8192, 100, 200),      # a hub motor
    (50.0, 131072, 1000, 18000),  # a servo of 17 bits
    (21.0, 501923, 100, 3000),
])
def test_reach_follows_the_motor(gear, edges, frequency, rpm):
    wheels = read_wheels({**SHIPPED, "gearboxReductionRatio": gear, "encoderEdgesPerMotorRevolution": edges,
                          "pidControlFrequency": frequency, "motorNoLoadSpeed": rpm * 2 * math.pi / 60})
    without_load = rpm / 60 * edges / frequency
    assert 1.4 * without_load < counts_in_reach(wheels) < 1.6 * without_load


def test_packets_of_the_most_wheels_fit_into_a_line():
    """160 bytes is what the firmware reads, 256 what the driver reads."""
    command = add_checksum(format_packet([-999.999] * MOST_WHEELS, 3))
    assert len(command) <= 160 + 1
    totals = ":8000" * MOST_WHEELS
    status = ":FFMMRR" + "0" * MOST_WHEELS
    assert len(format_packet([-9999] * MOST_WHEELS) + "FF" + totals + status + ":CCCC") <= LONGEST_LINE + 1


@pytest.mark.parametrize("key, value, words", [
    ("wheelRads", [45, 135, 225], "in degrees? then write [0.785398, 2.356194, 3.926991]"),
    ("wheelRads", [0.785, 135, 3.927], "; some in degrees, others not?"),
    ("wheelRads", [7.5, 127.5, 247.5], "in degrees? then write [0.1309, 2.225295, 4.31969]"),
    ("wheelRads", [45, 135, 225, 315], "a list of 3 numbers up to 12.57 [rad]"),  # no hint: one is too many
    ("referenceDirection", -90, "in degrees? then write -1.570796"),
    ("wheelRadius", 35, "in millimetres? then write 0.035"),
    ("wheelDistanceFromCenter", [125, 125, 130], "in millimetres? then write [0.125, 0.125, 0.13]"),
    ("wheelRadius", 3.5, "up to 2 times wheelDistanceFromCenter, 0.125 [m]: are both in metres?"),
    ("wheelRadius", [0.035, 35, 0.035], "a number from 0.001 to 10 [m], or a list of 3"),  # no hint with 35 micrometres
    ("wheelRadius", 1e-300, "a number from 0.001 to 10 [m], or a list of 3"),
    ("wheelRads", [0.0, 0.001, math.pi], "(these give a wheel matrix of rank < 3, or nearly); wheels 0 and 1 would "
     "stand at one place, 0 degrees: where motors on two sides drive the same way when they turn positive, "
     "positiveRotation is a list, one word per wheel"),
])
def test_another_unit_or_place_is_refused_with_what_is_meant(key, value, words):
    (fault,) = faults_of({**SHIPPED, key: value})
    assert fault.startswith(f"{key}: found {value!r}, allowed: ")
    assert fault.endswith(words)


@pytest.mark.parametrize("before, after, words", [
    ("gearboxReductionRatio: 18.75", "gearboxReductionRatio: 1:30",
     "found 1:30, which is 90 to YAML, allowed: a number, such as 30, in line "),
    ("wheelRadius: 0.035", "wheelRadius: 3e-2",
     "found '3e-2', allowed: a number from 0.001 to 10 [m], or a list of 3; '3e-2' is a text to YAML, write 0.03"),
    ("wheelRads", "wheelrads", "; did you mean wheelRads?"),
])
def test_what_a_file_alone_can_have_wrong(tmp_path, before, after, words):
    file = tmp_path / "wheel_params.yaml"
    file.write_text(WHEEL_PARAMS.read_text().replace(before, after))
    with pytest.raises(ValueError, match="wheel_params.yaml") as raised:
        read_wheel_file(file)
    assert words in str(raised.value)
