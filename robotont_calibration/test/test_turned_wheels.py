import pytest

from robotont_calibration.turned_wheels import TurnedWheels, main
from robotont_driver.robots.robot_folder import read_wheel_file
from robotont_testing.robots import ROBOTONT2_PARAMS, WHEEL_PARAMS
from robotont_testing.stand_in_board import Board


def test_a_wheel_is_shown_once_per_step_with_its_place_and_direction():
    turned = TurnedWheels(read_wheel_file(ROBOTONT2_PARAMS)[0])
    lines = [line for _ in range(100) for line in turned.add((0, -1, 0))]
    assert lines == ["wheel 1 (at 180 degrees): backward, -15 degrees in all"]
    assert turned.add((0, -100, 0)) == ["wheel 1 (at 180 degrees): backward, -60 degrees in all"]
    assert turned.add((0, 100, 0)) == ["wheel 1 (at 180 degrees): forward, -30 degrees in all"]
    assert turned.add((0, 0, 200)) == ["wheel 2 (at 300 degrees): forward, +60 degrees in all"]
    assert turned.verdict == "less than 30 degrees: wheel 0"


@pytest.mark.parametrize("params, turn", [(ROBOTONT2_PARAMS, "counterclockwise"), (WHEEL_PARAMS, "clockwise")])
def test_a_robot_that_was_turned_on_the_floor_shows_whether_the_signs_fit(params, turn):
    turned = TurnedWheels(read_wheel_file(params)[0])
    turned.add((300, 310, 290))
    assert turned.verdict.startswith(f"all wheels turned as if the robot had been turned {turn}")


def test_our_own_board_is_watched_and_hears_nothing(tmp_path, capsys):
    with Board(str(tmp_path / "board")) as board:
        follow = board.motors.follow
        board.motors.follow = lambda _: follow([20, -20, 20])  # a hand turns them: the board is not commanded
        assert main([board.link, "robot:=thesis", "--seconds", "1.5"]) == 0
        assert board.heard == []
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].endswith("turned clockwise, all its wheels must count forward. Ctrl-C ends it.")
    assert "wheel 0 (at 300 degrees): forward, +18 degrees in all" in shown  # three packets, as -18 of wheel 1
    assert shown[-1] == ("the wheels disagree about the robot's rotation: wheel 0 forward, wheel 1 backward, "
                         "wheel 2 forward")


def test_a_missing_port_and_a_wrong_wheel_file(tmp_path, capsys):
    assert main([str(tmp_path / "nothing"), "robot:=thesis"]) == 1
    assert "plugged in" in capsys.readouterr().err
    assert main(["/dev/null", f"robot:={tmp_path}"]) == 1
    assert f"{tmp_path}/wheel_params.yaml" in capsys.readouterr().err
