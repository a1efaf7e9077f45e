"""What the diagnostics say of a line: lost lines, a port that was opened anew."""

import types

import pytest
from checked_bench import Sender
from protocol_bench import official_wheels

from robotont_driver.command.command_age import Gaps
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.connection import Connection
from robotont_driver.robots.battery import Battery
from robotont_driver.ros import link_report
from robotont_driver.ros.diagnostics import ERROR, OK, WARN
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import identity, sealed


def link():
    """As a SerialLink whose port is open."""
    return types.SimpleNamespace(
        connection=Connection(read_wheels(SHIPPED), "checked"), trouble=None, opened=1, sent=0, unsent=0,
        timeouts=0, outdated=0, gaps=Gaps(0.5, 0.0))


def a_second(report, line, clock, sender, heard=1):
    """Level and words after a second in which every `heard`-th packet came."""
    for packet in range(50):
        clock[0] += 0.02
        data = sender.packet([1, 2, 3])
        if packet % heard == 0:
            line.connection.feed(data, clock[0])
    return report.report_link()[:2]


def test_lost_lines_are_told_and_a_port_that_is_opened_again_is_judged_afresh(monkeypatch):
    clock, line, sender, written = [100.0], link(), Sender(), types.SimpleNamespace(refused=0)
    monkeypatch.setattr(link_report, "time", types.SimpleNamespace(monotonic=lambda: clock[0]))
    report = link_report.LinkReport(line, written, Battery(None))
    a_second(report, line, clock, sender)
    assert a_second(report, line, clock, sender) == (OK, "50 packets/s, checked")
    level, words = a_second(report, line, clock, sender, heard=10)
    assert (level, words) == (WARN, "88% of the board's lines are lost or never sent: check cable and baudrate")
    a_second(report, line, clock, sender)
    line.connection.feed(b"noise\n" * 42, clock[0])
    written.refused = 7  # messages on serial_write, which are no lines of the board
    assert report.report_link()[:2] == (WARN, "42 lines dropped since the last report, the newest: "
                                        "no valid trailer in 'noise'; check cable and baudrate")
    a_second(report, line, clock, sender)
    written.refused = 9
    assert a_second(report, line, clock, sender) == (WARN, "2 messages on serial_write were no packets")
    for _ in range(3):
        line.connection = Connection(read_wheels(SHIPPED), "checked", now=clock[0])
        assert report.report_link()[:2] == (OK, "just opened")
        clock[0] += 0.6
        assert report.report_link()[1] == "port open, but no packets: is the firmware running, at this baudrate?"
        assert a_second(report, line, clock, sender) == (OK, "50 packets/s, checked")
        line.connection = Connection(read_wheels(SHIPPED), "checked", now=clock[0])
        assert a_second(report, line, clock, sender) == (OK, "50 packets/s, checked"), "the first report of it"


@pytest.mark.parametrize("packets, noise, words", [
    ("robotont2", b"1:2:3;\n" * 2, "the board speaks plain, which does not fit this robot"),
    ("checked", sealed("identity " + identity(wheels=4)), "the board drives 4 wheels")])
def test_a_board_that_is_not_driven_is_no_silent_one(packets, noise, words, monkeypatch):
    clock, line = [100.0], link()
    monkeypatch.setattr(link_report, "time", types.SimpleNamespace(monotonic=lambda: clock[0]))
    line.connection = Connection(read_wheels(SHIPPED), packets, now=clock[0])
    report = link_report.LinkReport(line, types.SimpleNamespace(refused=0), Battery(None))
    for _ in range(3):
        line.connection.feed(noise, clock[0])
        level, said = report.report_link()[:2]
        assert (level, words in said) == (WARN, True), said
        clock[0] += 1.0


def test_packets_of_the_first_tenths_of_a_second_are_packets(monkeypatch):
    clock, line, sender = [100.0], link(), Sender()
    monkeypatch.setattr(link_report, "time", types.SimpleNamespace(monotonic=lambda: clock[0]))
    line.connection = Connection(read_wheels(SHIPPED), "checked", now=clock[0])
    report = link_report.LinkReport(line, types.SimpleNamespace(refused=0), Battery(None))
    for _ in range(20):
        clock[0] += 0.02
        line.connection.feed(b"1:2:3;\n" + sender.packet(), clock[0])
    assert report.report_link()[:2] == (WARN, "19 lines dropped since the last report, the newest: "
                                        "no valid trailer in '1:2:3;'; check cable and baudrate")


@pytest.mark.parametrize("packets, line", [
    ("plain", b"1:2:3;\n"), ("auto", b"1:2:3;\n"),
    ("robotont2", b"ODOM:1.000000" + 5 * b":0.000000" + b"\r\n")])
@pytest.mark.parametrize("between", [True, False])
def test_the_start_on_a_perfect_line_is_no_warning(packets, line, between, monkeypatch):
    """The board runs already, and each line comes in two reads. between: a report comes before the first packet."""
    clock, board = [100.0], link()
    monkeypatch.setattr(link_report, "time", types.SimpleNamespace(monotonic=lambda: clock[0]))
    board.connection = Connection(official_wheels(), packets, now=clock[0])
    report = link_report.LinkReport(board, types.SimpleNamespace(refused=0), Battery(None))
    assert report.report_board()[:2] == (OK, "has sent no packet yet")
    for at in range(50):
        clock[0] += 0.02
        board.connection.feed(line[:3], clock[0])
        board.connection.feed(line[3:], clock[0])
        if between and at == 0:
            report.report_link()
    level, words, values = report.report_link()
    assert (level, values["lines dropped"]) == (OK, 1), words
    assert report.report_board()[:2] == (OK, "reports no fault")


def test_a_fault_of_the_board_is_logged_when_it_comes(monkeypatch):
    logged, line, errors = [], link(), []
    monkeypatch.setattr(link_report.rospy, "logerr", lambda words, *values: logged.append(words % values))
    line.connection = types.SimpleNamespace(obstacle="no board of this robot", protocol=types.SimpleNamespace(
        report_board=lambda: (errors, [], {})))
    report = link_report.LinkReport(line, types.SimpleNamespace(refused=0), Battery(None))
    for now in "stuck", "stuck, odd", "", line.connection.obstacle, "odd":
        errors[:] = [now] if now else []
        assert report.report_board()[0] == ERROR
    assert logged == ["the board: stuck", "the board: odd"]
