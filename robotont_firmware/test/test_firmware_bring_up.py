"""./robotont wheels --bring-up with the firmware itself on simulated motors."""

import builtins

import pytest
from lifted_robot import RobotAtAPort, SimMotor

from robotont_calibration import turned_wheels
from robotont_calibration.bring_up import judge


@pytest.mark.parametrize("wrong, status, found", [
    (False, 0, ["motor 0 is right", "motor 1 is right", "motor 2 is right"]),
    (True, 1, ["motor 0 is right", "motor 1 runs backward: swap DIRECTIONS[1]",
               "motor 2 does not turn, or its encoder counts less than 15 edges"]),
])
def test_each_motor_is_judged(monkeypatch, capsys, tmp_path, wrong, status, found):
    motors = [SimMotor() for _ in range(3)]
    if wrong:
        motors[1].drive = lambda effort, drive=motors[1].drive: drive(-effort)
        motors[2].powered = False
    monkeypatch.setattr(builtins, "input", print)
    with RobotAtAPort(tmp_path / "port", *motors) as robot:
        assert turned_wheels.main([robot.link, "--robot", "thesis", "--bring-up"]) == status
    shown = capsys.readouterr()
    assert "Lift the robot" in shown.out
    lines = [line for line in shown.out.splitlines() if line.startswith("motor ")]
    assert len(lines) == 3, shown
    assert all(line.startswith(words) for line, words in zip(lines, found)), shown


@pytest.mark.parametrize(("edges", "still"), [(1200, 14), (360, 4), (100, 3), (10000, 120)])
def test_what_is_no_turn_follows_the_encoder(edges, still):
    assert "does not turn" in judge(0, (still, 0, 0), (-still, 0, 0), edges)
    assert judge(0, (still + 6, 0, 0), (-still - 6, 0, 0), edges) == ""


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
    assert words in judge(1, forward, backward, 1200)
    assert bool(judge(1, forward, backward, 1200)) == bool(words)
