"""The server against browsers that mean well: what moves the robot."""

import time

import pytest

from robotont_teleop.hand.speeds import STOP
from robotont_testing.harness import wait_for


@pytest.mark.timed
def test_a_page_drives_and_its_silence_stops(timely):
    page = timely.ready_page()
    page.drive(0.3, 0.1, -1.0)
    wait_for(lambda: timely.robot.sent, "the command")
    start = time.monotonic()
    wait_for(lambda: timely.robot.sent[-1] == STOP, "the stop")
    assert time.monotonic() - start < 0.35
    assert timely.robot.sent == [(0.3, 0.1, -1.0), STOP]


def test_one_drives_and_the_others_watch_and_its_end_stops(served):
    one, two = served.ready_page(), served.ready_page()
    one.drive(0.3)
    wait_for(lambda: served.robot.sent, "the command")
    two.drive(-0.3)
    two.order("reset_odometry")
    wait_for(lambda: "refused" in two.messages, "the refusal")
    assert (-0.3, 0.0, 0.0) not in served.robot.sent
    two.order("take")
    wait_for(lambda: one.messages["state"]["driver"] == two.messages["hello"]["page"], "the new driver")
    two.drive(-0.3)
    two.drive(0.0)
    two.drive(-0.2)
    wait_for(lambda: (-0.2, 0.0, 0.0) in served.robot.sent, "the command after letting go")
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP, STOP, (-0.2, 0.0, 0.0)]
    two.close()
    wait_for(lambda: served.robot.sent[-1] == STOP, "the stop as it closes")


def test_everybody_may_stop_but_only_the_driver_releases_who_has_seen_the_newest_stop(served):
    one, two = served.ready_page(), served.ready_page()
    one.drive(0.3)
    two.send({"kind": "stop"})
    wait_for(lambda: one.messages["state"]["stopped"] and two.messages["state"]["stopped"], "the state")
    assert served.robot.orders == [("press",), ("cancel",)]
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP]
    two.order("release", pressed_at=two.messages["state"]["pressed_at"])
    wait_for(lambda: "refused" in two.messages, "the refusal")
    seen = one.messages["state"]["pressed_at"]
    two.send({"kind": "stop"})
    wait_for(lambda: one.messages["state"]["pressed_at"] != seen, "the second stop, during the second of a release")
    one.order("release", pressed_at=seen)
    wait_for(lambda: "late" in one.messages, "the refusal")
    assert served.robot.stopped
    one.order("release", pressed_at=one.messages["state"]["pressed_at"])
    wait_for(lambda: not served.robot.stopped, "the release")


def test_a_stick_that_is_held_during_a_stop_by_others_moves_nothing_behind_its_release(served):
    page = served.ready_page()
    served.robot.emergency_stop.press()
    page.drive(0.3)
    wait_for(lambda: page.messages["state"]["held"], "the held stick")
    page.order("release", pressed_at=served.robot.emergency_stop.pressed_at)
    wait_for(lambda: not served.robot.stopped, "the release")
    page.drive(0.3)
    page.order("take", 0)
    wait_for(lambda: "late" in page.messages, "an answer behind the command")
    assert set(served.robot.sent) <= {STOP}


def test_what_is_old_is_dropped_and_the_page_of_an_order_informed(timely):
    page = timely.ready_page()
    page.drive(0.3, time=page.time - 250)
    wait_for(lambda: page.messages.get("late") == {"kind": "late", "what": "drive"}, "words")
    for kind, fields in (("release", {"pressed_at": 0}), ("goal", {"x": 1.0, "y": 0.0}), ("give_back", {}),
                         ("take", {}), ("reset_odometry", {})):
        page.order(kind, time=page.time - 250, **fields)
        wait_for(lambda kind=kind: page.messages.get("late", {}).get("what") == kind, "words")
    assert not timely.robot.orders
    assert not timely.robot.sent
    assert timely.server.seat.driver is None


def test_orders_and_no_answer_is_lost_when_many_come_at_once(served):
    page = served.ready_page()
    page.order("goal", x=1.0, y=-2.5)
    page.send({"kind": "cancel"})
    page.order("give_back")
    page.order("reset_odometry")
    page.send(*[{"kind": "take", "time": 0}] * 20, {"kind": "fly"})
    wait_for(lambda: page.closed, "the refusal of the last")
    assert page.messages["late"]["what"] == "take"
    assert served.robot.orders == [("goal", 1.0, -2.5), ("cancel",), ("give_back",), ("reset_odometry",)]
