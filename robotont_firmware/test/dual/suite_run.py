"""The firmware's `run` from its start to its end: motors off however it ends, and nothing is allocated."""

from dual_tools import Locked, Robot, WildBoard, checked

from robotont_firmware import config
from robotont_firmware.main_loop import Controller


def test_run_ends_with_the_motors_off():
    robot = Robot()
    robot.board.ticks_left = 20
    robot.send("30:30:30")
    assert robot.controller.run() is False
    assert robot.board.stopped
    assert robot.board.fed == 20


def test_run_ends_when_the_pc_wants_the_repl():
    robot = Robot()
    robot.send("30:30:30")
    robot.board.inbox += checked("!repl")
    assert robot.controller.run() is True
    assert robot.board.stopped


def test_run_stops_the_motors_when_anything_raises():
    robot = Robot()

    def broken(_):
        raise ZeroDivisionError

    robot.board.fault = broken
    try:
        robot.controller.run()
    except ZeroDivisionError:
        pass
    else:
        raise AssertionError("not raised")
    assert robot.board.stopped


def test_the_whole_loop_allocates_nothing():
    lines = ["0:0:0", "-180.55:0.00:90.25", "", "0:0:0", "3:-3:9.5", "?"]
    lines = [checked(line) if line else b"\xff\x00;;;\n" * 40 for line in lines] + [b"1:2:3;\n", b"7" * 250]
    board = WildBoard(lines)
    controller = Controller(board, config, reset_cause="test")
    controller.start()
    with Locked():
        ended = controller.run()
    assert ended is False
    assert board.stopped
    assert board.sent > 220 * 30
    assert controller._tested == 2, "the order was obeyed"
