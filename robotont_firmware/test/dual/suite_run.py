"""The firmware's `run` from its start to its end: motors off however it ends, and nothing is allocated."""

from dual_tools import Locked, Robot, checked

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


class QuietBoard:
    """Allocates nothing: one command again and again, motors that turn with the effort."""

    def __init__(self, lines):
        self.lines = lines
        self.ticks = 0
        self.total = 0
        self.sent = 0
        self.stopped = False

    def wait_tick(self):
        self.ticks += 1
        return 0 if self.ticks > 600 else 2 if self.ticks == 300 else 1

    def counts(self, totals):
        self.total = (self.total + 150) & 0xFFFF
        for wheel in range(len(totals)):
            totals[wheel] = self.total

    def drive(self, wheel, effort):
        assert -4000 <= effort <= 4000

    def fault(self, wheel):
        return self.ticks == 200 and wheel == 1

    def read(self, buffer):
        if 400 < self.ticks < 450:
            return 0
        line = self.lines[self.ticks % len(self.lines)]
        for at in range(len(line)):
            buffer[at] = line[at]
        return len(line)

    def write(self, buffer, size):
        self.sent += size

    def feed(self):
        pass

    def stop(self):
        self.stopped = True


def test_the_whole_loop_allocates_nothing():
    lines = [
        checked("-180.55:0.00:90.25"),
        b"",
        b"\xff\x00;;;\n" * 40,
        checked("0:0:0") * 5,
        b"1:2:3;\n",
        b"7" * 250,
    ]
    board = QuietBoard(lines)
    controller = Controller(board, config, reset_cause="test")
    controller.start()
    with Locked():
        ended = controller.run()
    assert ended is False
    assert board.stopped
    assert board.sent > 600 * 30
