"""./robotont wheels --tune with the firmware itself on simulated motors, in no time."""

import re
import sys

import pytest
import serial
from firmware_tools import DUAL

from robotont_boards import BOARDS
from robotont_driver.tools.bring_up import BringUpError
from robotont_driver.tools.tune import Tune, present_numbers
from robotont_driver.tools.turned_wheels import SLOWEST
from robotont_firmware import __version__, config, identity
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors

sys.path.append(str(DUAL))
from dual_tools import Config, checked
from lifted_robot import MOST, WHEELS, LiftedRobot
from sim_motor import BRAKE, CHANCE, COAST, DIODE, FLOATING, HALF, REVERSED, UNPLUGGED, SimMotor


def profile(name):
    return Config(**{key: value for key, value in present_numbers(name).items() if key.isupper()})


def numbers(shown):
    """{name: number} that is proposed."""
    return {words[0]: int(words[2]) for words in map(str.split, shown.splitlines()) if words[1:2] == ["="]}


@pytest.mark.parametrize("motor, name", [
    ({}, "ours"),
    ({"tau": 40, "friction": 14}, "ours"),
    ({"tau": 110, "friction": 4, "battery": 85}, "ours"),
    ({"driver": DIODE}, "vnh"),
])
def test_the_numbers_of_the_motors_are_proposed(motor, name):
    """Of SimMotor: friction in units of 4000 / 208 effort, time constant [ms]; a diode's drop counts as friction."""
    robot = LiftedRobot(*(SimMotor(**motor) for _ in range(3)), settings=profile(name))
    right, shown = robot.tune()
    assert right, shown
    unit = 4000 / 208 * 100 / motor.get("battery", 100)  # [effort]
    found = numbers(shown)
    if name == "ours":
        assert abs(found["STATIC"] - motor.get("friction", 8) * unit) < 4, shown
        assert abs(found["SPEED_GAIN"] - 256 * unit) < 0.005 * 256 * unit, shown
    else:
        assert abs(found["STATIC"] - config.STATIC * 2.5) < 20, shown
    tau = 16 / 20 * motor.get("tau", 60)
    assert abs(found["FREE_LEAD"] - 12 - tau) < 1.5
    assert abs(found["LEAD"] - (240 - 38) - tau) < 1.5
    assert f"now {profile(name).SPEED_GAIN}" in shown
    assert 0 < robot.fastest <= MOST


@pytest.mark.parametrize("change, words", [
    ({"encoder": CHANCE}, "1 forward   .*\n.*DOES NOT HOLD: its counts leave the model"),
    ({"friction": 24}, "wheel 1 differs: speed -3[0-9] %, .* friction \\+[0-9]+: more friction"),
    ({"tau": 90}, "wheel 1 differs: speed \\+0 %, time constant \\+5[0-9] %.*: a heavier wheel"),
])
def test_a_wheel_that_is_not_like_the_others_is_named_and_nothing_is_proposed(change, words):
    odd = SimMotor(**{name: value for name, value in change.items() if name != "encoder"})
    odd.encoder = change.get("encoder", 0)
    right, shown = LiftedRobot(SimMotor(), odd, SimMotor()).tune()
    assert not right
    assert re.search(words, shown), shown
    assert "nothing is proposed" in shown
    assert numbers(shown) == {}


def broken(encoder=0, powered=True):
    motor = SimMotor()
    motor.encoder, motor.powered = encoder, powered
    return motor


@pytest.mark.parametrize("motor, words", [
    (broken(UNPLUGGED), "wheel 1 does not turn forward with 600 of 4000"),
    (broken(HALF), "wheel 1 does not turn forward"),
    (broken(REVERSED), "wheel 1 counts backward"),
    (broken(FLOATING), "wheel 1 does not come to rest: noise"),
    (broken(powered=False), "wheel 1 does not turn forward"),
])
def test_what_is_broken_ends_it(motor, words):
    robot = LiftedRobot(SimMotor(), motor, SimMotor())
    with pytest.raises(BringUpError, match=words):
        robot.tune()
    robot.read(0)
    assert robot.efforts == [0, 0, 0]


def test_drivers_that_coast_have_no_such_numbers():
    robot = LiftedRobot(*(SimMotor(driver=COAST, frequency=100, battery=140) for _ in range(3)),
                        settings=profile("robotont21"))  # fmt: skip
    right, shown = robot.tune()
    assert not right
    assert "NO FIT: it turns from 300 on" in shown
    assert "a driver that coasts" in shown
    assert robot.fastest <= config.TEST_SPEED


@pytest.mark.parametrize("most", [54, 999])
@pytest.mark.parametrize("motor", [
    {"tau": tau, "battery": battery, "driver": driver, "frequency": 100 if driver == COAST else 20000, "friction": 1}
    for tau in (40, 100) for battery in (100, 140) for driver in (BRAKE, DIODE, COAST)
])
def test_no_order_makes_a_wheel_faster_than_it_says_nor_than_the_board_allows(motor, most):
    """By the true edges of the motors; whichever effort, again and again, one way and at once the other."""
    robot = LiftedRobot(*(SimMotor(**motor) for _ in range(3)))
    while robot.controller._silence < config.TIMEOUT:
        robot.read(0)
    for effort in (100, 500, 999):
        for sign in "+-":
            for wait in (3, 25):
                robot.write(checked(f"!test 0{sign}{effort}:{most}"))
                for _ in range(wait):
                    robot.read(0)
    assert robot.motors[0].turned != 0
    assert robot.fastest <= min(most, config.TEST_SPEED)


@pytest.mark.parametrize("motor", [
    {"tau": 15, "battery": 140}, {"tau": 30, "battery": 170, "friction": 2}, {"tau": 200}])
@pytest.mark.parametrize("most", [SLOWEST, MOST])
def test_growing_steps_keep_any_wheel_within_a_low_bound(motor, most):
    robot = LiftedRobot(*(SimMotor(**motor) for _ in range(3)))
    robot.tune(most)
    assert most / 2 < robot.fastest <= most


def fault(robot):
    robot.board.faults[2] = True


def key(robot):
    robot.key = True


def silence(robot):
    robot.silent = True


@pytest.mark.parametrize("happen, words, periods", [
    (fault, "wheel 2: its motor driver reports a fault", 3),
    (key, "ended by a key", 2),
    (silence, "the board is silent for 0.3 s", 0.3 * config.RATE + 3),
])
def test_what_happens_in_mid_step_ends_it_at_once(happen, words, periods):
    robot, happened = LiftedRobot(), []
    driven = [0, 0]  # periods of the newest step, steps

    def look():
        driven[0] = driven[0] + 1 if robot.controller._test_left > 0 else 0
        driven[1] += driven[0] == 8
        if driven == [8, 10] and not happened:
            happened.append(robot.ticks)
            happen(robot)

    robot.each_tick = look
    with pytest.raises(BringUpError, match=words):
        robot.tune(pressed=lambda: robot.key)
    assert robot.ticks - happened[0] <= periods
    assert robot.told.startswith(b"!test 0+0:0;")
    assert any(robot.efforts) == (happen is not fault)
    robot.read(0)
    assert robot.efforts == [0, 0, 0]


def test_an_older_firmware_is_refused(monkeypatch):
    assert __version__ == "2.2.0"
    monkeypatch.setattr(identity, "__version__", "2.1.0")
    with pytest.raises(BringUpError, match=r"firmware 2\.1\.0, older than 2\.2"):
        LiftedRobot().tune()


def test_another_board_is_refused_and_hears_no_order(tmp_path):
    port = BoardPort(str(tmp_path / "board"), lambda now: BOARDS["robotont2"](Motors(), start=now))
    port.plug()
    try:
        with serial.Serial(port.link, timeout=0.02) as opened, pytest.raises(BringUpError, match=r"from 2\.2 on"):
            Tune(opened, WHEELS, MOST).prepare()
    finally:
        port.unplug()
    assert b"test" not in b"".join(data for _, data in port.heard)
