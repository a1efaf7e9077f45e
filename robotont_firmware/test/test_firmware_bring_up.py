"""./robotont wheels --bring-up with the firmware itself on simulated motors."""

import builtins
import contextlib

import pytest
from lifted_robot import RobotAtAPort, SimMotor

from robotont_driver.tools import turned_wheels
from robotont_driver.tools.bring_up import judge


def bring_up(monkeypatch, capsys, motors):
    monkeypatch.setattr(builtins, "input", lambda words: print(words))
    with contextlib.closing(RobotAtAPort(*motors)) as robot:
        status = turned_wheels.main([robot.port, "--robot", "thesis", "--bring-up"])
    shown = capsys.readouterr()
    return status, [line for line in shown.out.splitlines() if line.startswith("motor ")], shown


def test_each_motor_is_judged(monkeypatch, capsys):
    motors = [SimMotor() for _ in range(3)]
    motors[1].drive = lambda effort, drive=motors[1].drive: drive(-effort)
    motors[2].powered = False
    status, lines, shown = bring_up(monkeypatch, capsys, motors)
    assert "Lift the robot" in shown.out
    assert [line.split(":")[0].split(" (")[0] for line in lines] == [
        "motor 0 is right", "motor 1 runs backward", "motor 2 does not turn, or its encoder counts nothing"], shown
    assert "motor 1 runs backward: swap DIRECTIONS[1]" in lines[1]
    assert status == 1


def test_a_robot_that_is_right(monkeypatch, capsys):
    status, lines, shown = bring_up(monkeypatch, capsys, ())
    assert [line.split(" (")[0] for line in lines] == [f"motor {motor} is right" for motor in range(3)], shown
    assert status == 0


@pytest.mark.parametrize(("forward", "backward", "words"), [
    ((0, 200, 0), (0, -200, 0), ""),
    ((0, -200, 0), (0, 200, 0), "runs backward: swap DIRECTIONS[1]"),
    ((0, 0, 0), (0, 1, 0), "does not turn"),
    ((200, 0, 0), (-200, 0, 0), "turns wheel 0, or its encoder is connected there"),
    ((0, 200, 0), (0, 0, 0), "one of its direction pins"),
    ((0, 200, 0), (0, 200, 0), "one of its direction pins"),
    ((0, 200, 0), (0, -80, 0), "much slower one way"),
    ((0, 200, 100), (0, -200, -90), "turns wheel 2, too"),
])  # fmt: skip
def test_what_the_counts_mean(forward, backward, words):
    assert words in judge(1, forward, backward)
    assert bool(judge(1, forward, backward)) == bool(words)


def test_without_a_terminal_or_our_firmware_nothing_is_driven(monkeypatch, capsys):
    def closed(_):
        raise EOFError

    monkeypatch.setattr(builtins, "input", closed)
    assert turned_wheels.main(["/dev/null", "--robot", "thesis", "--bring-up"]) == 1
    assert "nothing was driven" in capsys.readouterr().err
