import math

import pytest

from robotont_driver.kinematics.wheel_params import MOST_WHEELS, read_wheels
from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.protocol.checksum import add_checksum
from robotont_driver.protocol.packet import LONGEST_LINE, format_packet
from robotont_driver.robots.wheel_file import read_wheel_file
from robotont_testing.robots import SHIPPED, WHEEL_PARAMS


def faults_of(given):
    with pytest.raises(ParameterError) as raised:
        read_wheels(given)
    return raised.value.faults


def test_shipped_wheels_stand_where_their_angles_say():
    positions = read_wheels(SHIPPED).positions
    expected = [math.remainder(rad, 2 * math.pi) for rad in SHIPPED["wheelRads"]]
    assert [math.remainder(position, 2 * math.pi) for position in positions] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("key, value", [
    ("wheelAmount", 2), ("wheelAmount", 3.0), ("wheelAmount", "3"), ("wheelAmount", True), ("wheelAmount", None),
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
])
def test_a_wrong_value_is_named_with_what_was_found(key, value):
    faults = faults_of({**SHIPPED, key: value})
    named = [fault for fault in faults if fault.startswith(key + ":")]
    if (key, value) == ("wheelAmount", 4):  # the amount is allowed; then the list is too short
        named = [fault for fault in faults if fault.startswith("wheelRads:")]
        value = SHIPPED["wheelRads"]
    assert len(named) == 1
    assert f"found {value!r}, allowed: " in named[0]


def test_packets_of_the_most_wheels_fit_into_a_line():
    """160 bytes is what the firmware reads, 256 what the driver reads."""
    command = add_checksum(format_packet([-999.999] * MOST_WHEELS, 3))
    assert len(command) <= 160 + 1
    totals = ":8000" * MOST_WHEELS
    status = ":FFMMRR" + "0" * MOST_WHEELS
    assert len(format_packet([-9999] * MOST_WHEELS) + "FF" + totals + status + ":CCCC") <= LONGEST_LINE + 1


@pytest.mark.parametrize("key, value, words", [
    ("wheelRads", [45, 135, 225], "in degrees? then write [0.785398, 2.356194, 3.926991]"),
    ("referenceDirection", -90, "in degrees? then write -1.570796"),
    ("wheelRadius", 35, "in millimetres? then write 0.035"),
    ("wheelDistanceFromCenter", [125, 125, 130], "in millimetres? then write [0.125, 0.125, 0.13]"),
    ("wheelRadius", 3.5, "up to 2 times wheelDistanceFromCenter, 0.125 [m]: are both in metres?"),
    ("wheelRadius", 1e-300, "a number from 0.001 to 10 [m]"),
    ("wheelRads", [0.0, 0.001, math.pi], "(these give a wheel matrix of rank < 3)"),
])
def test_another_unit_or_place_is_refused_with_what_is_meant(key, value, words):
    (fault,) = faults_of({**SHIPPED, key: value})
    assert fault.startswith(f"{key}: found {value!r}, allowed: ")
    assert fault.endswith(words) or words in fault


@pytest.mark.parametrize("before, after, words", [
    ("gearboxReductionRatio: 18.75", "gearboxReductionRatio: 1:30",
     "gearboxReductionRatio: found 1:30, allowed: a number, such as 30"),
    ("wheelRads", "wheelrads", "; did you mean wheelRads?"),
])
def test_what_a_file_alone_can_have_wrong(tmp_path, before, after, words):
    file = tmp_path / "wheel_params.yaml"
    file.write_text(WHEEL_PARAMS.read_text().replace(before, after))
    with pytest.raises(ValueError, match="wheel_params.yaml") as raised:
        read_wheel_file(file)
    assert words in str(raised.value)
