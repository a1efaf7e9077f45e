"""The page's commands, in virtual time."""

import pytest

from robotont_teleop.hand.speeds import STOP, Speeds
from robotont_teleop.web.driving_seat import DrivingSeat
from robotont_teleop.web.page_messages import MessageError, read_message

FORWARD = (0.3, 0.0, 0.0)


@pytest.fixture
def seat():
    return DrivingSeat(Speeds(0.5, 2.0), oldest=0.2, dead_man=0.3)


def test_a_late_command_is_dropped_whatever_it_is(seat):
    assert seat.command("one", 10.0, FORWARD, 10.21) is None
    assert seat.command("one", 10.0, STOP, 10.21) is None
    assert seat.command("one", 11.0, FORWARD, 10.0) is None, "a time that the server has not sent yet"


def test_a_zero_stops_however_late_it_comes(seat):
    seat.command("one", 10.0, FORWARD, 10.05)
    assert seat.command("two", 10.0, STOP, 10.25) is None, "of a page that does not drive"
    assert seat.command("one", 10.02, STOP, 10.25) == STOP
    assert seat.look(10.6) is None, "the robot stands already"
    assert seat.command("one", 10.5, FORWARD, 10.6) == FORWARD


def test_silence_stops_and_the_sticks_must_be_let_go(seat):
    seat.command("one", 10.0, FORWARD, 10.0)
    assert seat.time_left(10.1) == pytest.approx(0.2)
    assert seat.look(10.29) is None
    assert seat.look(10.3) == STOP
    assert seat.look(10.31) is None
    assert seat.time_left(10.31) is None
    assert seat.command("one", 10.1, STOP, 10.35) is None, "too late to count as letting go"
    assert seat.command("one", 10.4, FORWARD, 10.4) is None
    assert seat.held == {"one"}
    assert seat.command("one", 10.5, STOP, 10.5) == STOP
    assert seat.command("one", 10.6, FORWARD, 10.6) == FORWARD


def test_the_dead_mans_time_counts_from_what_the_page_has_seen(seat):
    seat.command("one", 10.0, FORWARD, 10.19)  # the way to the page stalls: it goes on with the last time it has
    assert seat.time_left(10.19) == pytest.approx(0.11)
    assert seat.look(10.301) == STOP


@pytest.mark.parametrize("event, who, driver", [
    (lambda seat: seat.stop(), "one", "one"),
    (lambda seat: seat.command("one", 10.02, FORWARD, 10.02, stopped=True), "one", "one"),  # pressed elsewhere
    (lambda seat: seat.take("two"), "two", "two"),
    (lambda seat: seat.leave("one"), "two", None),
], ids=["emergency stop", "emergency stop of others", "take-over", "free seat"])
def test_a_stick_that_is_held_does_not_drive_behind(event, who, driver, seat):
    seat.command("one", 10.0, FORWARD, 10.0)
    assert seat.command("two", 10.0, FORWARD, 10.0) is None
    assert seat.command("two", 10.0, STOP, 10.0) is None
    assert seat.leave("three") is None
    seat.command("two", 10.0, FORWARD, 10.0)
    assert event(seat) == STOP
    assert seat.command(who, 10.05, FORWARD, 10.05) is None
    assert seat.driver == driver
    seat.command(who, 10.1, STOP, 10.1)
    assert seat.command(who, 10.15, FORWARD, 10.15) == FORWARD


def test_no_command_exceeds_the_speeds_and_all_keep_their_direction(seat):
    v_x, v_y, omega = seat.command("one", 10.0, (3.0, 4.0, -1.0), 10.0)
    assert (v_x, v_y, omega) == pytest.approx((0.3, 0.4, -0.1))


@pytest.mark.parametrize("text", [
    "", "null", "[]", "{}", '{"kind":"fly"}', '{"kind":["drive"]}', '{"kind":"stop","now":1}', '{"kind":"drive"}',
    '{"kind":"drive","time":1,"x":NaN,"y":0,"turn":0}', '{"kind":"drive","time":1,"x":"1","y":0,"turn":0}',
    '{"kind":"drive","time":1,"x":true,"y":0,"turn":0}', '{"kind":"drive","time":null,"x":0,"y":0,"turn":0}',
    '{"kind":"drive","time":1,"x":1' + 400 * "0" + ',"y":0,"turn":0}', "[" * 512, b"\xff", "\ud800",
])
def test_messages_that_are_refused(text):
    with pytest.raises(MessageError):
        read_message(text)
