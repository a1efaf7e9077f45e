"""Robots of other projects, with their own numbers: right, or refused with the cause."""

import math

import numpy as np
import pytest

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import counts_in_reach, doubts, read_wheels
from robotont_driver.parameters.parameters import ParameterError
from robotont_testing.robots import BARE

# source: (degrees from forward at which the wheels stand, [m] from the centre, [m] radius, other keys)
ROBOTS = {
    "roboscienceorg/book OmniwheelExample": ((60, 180, 300), 0.125, 0.035, {}),
    "SSL-A-Team/firmware, today": ((330 + 90, 45 + 90, 135 + 90, 210 + 90), 0.0814, 0.030, {}),
    "SSL-A-Team/firmware, before": ((300 + 90, 45 + 90, 135 + 90, 240 + 90), 0.0814, 0.0247, {}),
    "RoboCup-SSL/grSim defaults": ((60, 135, 225, 300), 0.09, 0.0325, {"robotMass": 2.8}),
    "kallaspriit/Robocup-Simulator": ((-135, -45, 45, 135), 0.12, 0.025, {"robotMass": 2.5}),
    "huggingface/lerobot lekiwi": ((150, -90, 30), 0.125, 0.05, {
        "gearboxReductionRatio": 1, "encoderEdgesPerMotorRevolution": 4096, "motorNoLoadSpeed": 4.712}),
    "LeKiwi, uneven": ((0, 120, 240), [0.085, 0.105, 0.105], 0.05, {
        "gearboxReductionRatio": 1, "encoderEdgesPerMotorRevolution": 4096, "motorNoLoadSpeed": 4.712,
        "robotMass": 1.5}),
    "brunolemosdl/hybrid-robot-navigation": ((45, -45, 135, -135), math.hypot(0.04964, 0.04965), 0.023, {
        "gearboxReductionRatio": 2.398795}),
    "HEBI setupOmniBase": ((30, 150, 270), 0.235, 0.075, {"robotMass": 12.0}),
    "omnidirectional_controllers 0.21": ((0, 120, 240), 0.21, 0.05, {}),
    "mateusmenezes95/omnidirectional_controllers, its tests": ((30, 150, 270), 0.1, 0.053112205, {
        "pidControlFrequency": 1000}),
    "omnidirectional_controllers 0.1826": ((30, 150, 270), 0.1826, 0.060, {}),
    "omni_wheel_controller X": ((45, 135, -135, -45), 0.3347, 0.0762, {"pidControlFrequency": 100}),
    "four motors of 91/6": ((45, 135, 225, 315), math.hypot(0.266413, 0.266413), 0.0762, {
        "gearboxReductionRatio": 91 / 6}),
    "robot_constants.py, gear 13.2": ((0, 120, 240), 8 * 0.0254, 2 * 0.0254, {
        "gearboxReductionRatio": 4.4 * 33 / 11, "encoderEdgesPerMotorRevolution": 48}),
    "robotConfig of 51 mm": ((120, 240, 0), 0.051, 0.0175, {}),
    "KMiyawaki/oit_roboclaw_driver omni 4": ((45, 135, 225, 315), 0.259, 0.1, {"pidControlFrequency": 20}),
    "pythfinder KiwiKinematics": ((0, -120, 120), 0.1, 0.03, {}),
    "mbot omni, gear 78": ((30, 150, 270), 0.10843, 0.048, {
        "gearboxReductionRatio": 78.0, "encoderEdgesPerMotorRevolution": 48.0}),
    "a servo of 17 bits": ((0, 120, 240), 0.2, 0.076, {
        "gearboxReductionRatio": 20, "encoderEdgesPerMotorRevolution": 131072, "motorNoLoadSpeed": 314.16}),
}
X_DRIVE = {**BARE, "wheelAmount": 4, "wheelRads": [math.radians(angle) for angle in (315, 45, 45, 315)]}
MECANUM = {**BARE, "wheelAmount": 4, "wheelRads": [0.0] * 4,  # NidasioAlberto/robotics-2022
           "wheelPositionRads": [math.atan2(y, x) for x in (0.2, -0.2) for y in (0.169, -0.169)],
           "wheelDistanceFromCenter": math.hypot(0.2, 0.169), "wheelRadius": 0.07, "gearboxReductionRatio": 5,
           "encoderEdgesPerMotorRevolution": 42}


@pytest.mark.parametrize("source", ROBOTS)
def test_a_robot_of_another_project(source):
    """Against the mechanics of its contact points, there and back; as its makers' firmware orders the wheels."""
    places, distances, radius, keys = ROBOTS[source]
    wheels = read_wheels({**BARE, "wheelAmount": len(places), "wheelDistanceFromCenter": distances,
                          "wheelRads": [math.remainder(math.radians(place + 90), 2 * math.pi) for place in places],
                          "wheelRadius": radius, **keys})
    assert not doubts(wheels)
    kinematics, twist = Kinematics(wheels), (0.3, -0.2, 0.7)
    for place, distance, speed in zip(map(math.radians, places), np.broadcast_to(distances, len(places)),
                                      kinematics.wheel_speeds(twist)):
        assert speed == pytest.approx(-math.sin(place) * 0.3 - math.cos(place) * 0.2 + distance * 0.7, abs=1e-12)
    back = kinematics.inverse @ (kinematics.units_of_twist(twist) / kinematics.units_per_speed)
    assert back == pytest.approx(twist, abs=1e-13)
    fastest = wheels.motor.no_load_speed / wheels.gear * radius  # [m/s] of the rim
    assert counts_in_reach(wheels) > fastest / wheels.metres_per_edge[0] / wheels.pid_frequency


def test_an_x_drive_whose_wheels_all_turn_forward_needs_a_sign_per_wheel():
    with pytest.raises(ParameterError) as refused:
        read_wheels(X_DRIVE)
    assert "wheels 0 and 3 would stand at one place, 225 degrees: where motors on two sides" in str(refused.value)
    wheels = read_wheels({**X_DRIVE, "positiveRotation": [
        "clockwise", "counterclockwise", "clockwise", "counterclockwise"]})
    assert np.degrees(wheels.positions) % 360 == pytest.approx([45, 315, 135, 225])
    assert Kinematics(wheels).wheel_speeds((1, 0, 0)) == pytest.approx([math.sqrt(0.5)] * 4)
    assert Kinematics(wheels).wheel_speeds((0, 0, 1)) == pytest.approx([-0.125, 0.125, -0.125, 0.125])


def test_mecanum_wheels_are_refused_with_the_cause():
    with pytest.raises(ParameterError) as refused:
        read_wheels(MECANUM)
    assert "all wheels drive in one direction: mecanum wheels are no omni wheels" in str(refused.value)
