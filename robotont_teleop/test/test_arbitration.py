"""Who drives, in virtual time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_teleop.mux.arbitration import EMERGENCY_STOP, NOBODY, STOP, Arbiter, Input

HAND, OTHER, NAVIGATION, DEFAULT = (0.1, 0.0, 0.0), (-0.1, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3)
INPUTS = (Input("hand", 0.3, 2.0), Input("navigation", 0.5, 1.0), Input("default", 0.5, 0.0))


@pytest.fixture
def arbiter():
    return Arbiter(INPUTS)


def test_of_two_hands_the_first_drives_until_it_stops(arbiter):
    assert arbiter.command("hand", HAND, 1.0, "page") == [HAND]
    assert arbiter.command("hand", OTHER, 1.05, "keys") == []
    assert arbiter.command("hand", STOP, 1.06, "keys") == []
    assert arbiter.command("hand", OTHER, 1.08, "keys") == []
    assert arbiter.ignored(1.1) == [("hand", "keys", "page")]
    assert arbiter.command("hand", HAND, 1.1, "page") == [HAND]
    assert arbiter.command("hand", STOP, 1.2, "page") == [STOP]
    assert arbiter.ignored(1.2) == []
    assert arbiter.command("hand", OTHER, 1.25, "keys") == [OTHER]
    assert arbiter.command("hand", HAND, 1.3, "page") == []


def test_a_zero_of_another_sender_stops_navigation_where_that_is_wanted():
    arbiter = Arbiter([Input("navigation", 0.5, 1.0, zeros_of_all=True)])
    arbiter.command("navigation", NAVIGATION, 1.0, "move_base")
    assert arbiter.command("navigation", STOP, 1.05, "navigation_monitor") == [STOP]
    assert arbiter.command("navigation", NAVIGATION, 1.1, "move_base") == [NAVIGATION]


def test_navigation_that_has_to_stand_for_a_while_keeps_the_robot_and_goes_on_by_its_next_command(arbiter):
    arbiter.command("navigation", NAVIGATION, 1.0)
    assert arbiter.stand("navigation", 0.5, 1.05) == [STOP]
    assert arbiter.command("navigation", NAVIGATION, 1.1) == [STOP]
    assert arbiter.command("default", DEFAULT, 1.2) == []
    assert arbiter.command("hand", HAND, 1.3) == [HAND]
    assert arbiter.stand("navigation", 0.5, 1.35) == []  # the hand drives on
    arbiter.command("hand", STOP, 1.4)
    assert arbiter.look(4.0) == []
    assert arbiter.command("navigation", NAVIGATION, 4.0) == [NAVIGATION]
    arbiter.stand("navigation", 2.0, 4.1)  # longer than its rest
    arbiter.stand("navigation", 0.3, 4.2)  # of somebody else, and shorter
    for step in range(1, 20):
        assert arbiter.command("navigation", NAVIGATION, 4.1 + step / 10) in ([], [STOP])
        assert arbiter.command("default", DEFAULT, 4.15 + step / 10) == []
    assert arbiter.command("navigation", NAVIGATION, 6.1) == [NAVIGATION]


def test_a_stand_is_no_zero_of_a_sender_that_has_to_stop_first_after_an_emergency_stop(arbiter):
    arbiter.command("navigation", NAVIGATION, 1.0, "move_base")
    arbiter.emergency_stop(True, 1.1)
    arbiter.command("navigation", NAVIGATION, 1.2, "move_base")
    arbiter.emergency_stop(False, 1.3)
    arbiter.stand("navigation", 0.2, 1.35)
    assert [arbiter.command("navigation", NAVIGATION, 1.3 + step / 10, "move_base") for step in range(1, 9)] == [[]] * 8


def test_the_hand_gives_back_after_its_rest(arbiter):
    arbiter.command("hand", HAND, 0.0)
    assert arbiter.command("hand", STOP, 0.1) == [STOP]
    for step in range(1, 20):
        assert arbiter.command("navigation", NAVIGATION, 0.1 + step / 10 - 0.05) == []
    assert arbiter.time_left(1.9) == pytest.approx(0.1)
    assert arbiter.look(2.0) == []  # the robot stands already
    assert arbiter.driver == "navigation"
    assert arbiter.command("navigation", NAVIGATION, 2.05) == [NAVIGATION]


def test_zeros_of_an_idle_hand_hold_up_nobody(arbiter):
    arbiter.command("navigation", NAVIGATION, 0.0)
    assert arbiter.command("hand", STOP, 0.1) == []
    assert arbiter.command("navigation", NAVIGATION, 0.2) == [NAVIGATION]


def test_silence_stops_the_robot_once(arbiter):
    arbiter.command("hand", HAND, 0.0)
    assert arbiter.time_left(0.1) == pytest.approx(0.2)
    assert arbiter.look(0.29) == []
    assert arbiter.look(0.3) == [STOP]
    assert arbiter.look(0.31) == []
    assert (arbiter.driver, arbiter.timeouts) == ("hand", 1)
    assert arbiter.look(2.0) == []
    assert arbiter.driver == NOBODY


def test_who_comes_back_after_a_silence_is_stopped_before(arbiter):
    arbiter.command("hand", HAND, 0.0)
    assert arbiter.command("hand", HAND, 1.0) == [STOP, HAND]


def test_the_default_drives_until_it_is_silent_and_a_rest_is_no_shorter_than_the_silence(arbiter):
    assert arbiter.command("default", DEFAULT, 0.0) == [DEFAULT]
    assert arbiter.look(0.49) == []
    assert arbiter.look(0.5) == [STOP]
    assert arbiter.driver == NOBODY


def test_after_an_emergency_stop_nobody_rests_with_the_robot_still_his(arbiter):
    arbiter.command("hand", HAND, 0.0)
    arbiter.emergency_stop(True, 0.1)
    arbiter.emergency_stop(False, 0.2)
    assert arbiter.look(0.21) == []
    assert arbiter.driver == NOBODY
    assert arbiter.command("navigation", NAVIGATION, 0.3) == [NAVIGATION]


def test_an_emergency_stop_locks_at_once_and_goes_on_saying_so(arbiter):
    arbiter.command("hand", HAND, 0.0)
    assert arbiter.emergency_stop(True, 0.1) == [STOP]
    assert arbiter.driver == EMERGENCY_STOP
    assert arbiter.command("hand", HAND, 0.2) == []
    assert arbiter.look(0.25) == []
    assert arbiter.look(0.301) == [STOP]


def test_who_has_asked_for_motion_stops_first_after_a_release_and_who_has_not_may_drive_beside_him():
    arbiter = Arbiter([Input("hand", 0.3, 2.0)])
    arbiter.command("hand", OTHER, -1.0, "keys")  # silent long before
    arbiter.emergency_stop(True, 0.0)
    arbiter.command("hand", HAND, 0.1, "page")
    arbiter.emergency_stop(False, 0.2)
    assert arbiter.command("hand", HAND, 0.25, "page") == []
    assert arbiter.barred(0.25) == ["hand"]
    assert arbiter.command("hand", OTHER, 0.3, "keys") == [OTHER]
    arbiter.command("hand", STOP, 0.35, "keys")
    arbiter.command("hand", STOP, 0.4, "page")
    assert arbiter.command("hand", HAND, 0.45, "page") == [HAND]


def test_a_person_may_excuse_who_has_not_stopped(arbiter):
    arbiter.command("hand", HAND, 0.0)
    arbiter.emergency_stop(True, 0.05)
    arbiter.command("hand", HAND, 0.1)
    arbiter.emergency_stop(False, 0.15)
    assert arbiter.give_back(0.2) == []
    assert arbiter.command("hand", HAND, 0.25) == [HAND]


TWISTS = {"hand": HAND, "navigation": NAVIGATION, "default": DEFAULT}


@given(st.lists(st.tuples(
    st.floats(0.0, 0.7), st.sampled_from(["hand", "navigation", "default", "press", "release", "give back", "look"]),
    st.booleans()), max_size=60))
def test_whatever_happens_drivers_do_not_mix_and_silence_stops(events):
    arbiter, now, sent, pressed = Arbiter(INPUTS), 0.0, [], False
    received = {}
    for pause, kind, moving in events:
        end = now + pause
        while True:  # as the node does: look whenever something may be due
            left = arbiter.time_left(now)
            if left is None or now + left > end:
                break
            now += left + 1e-9
            sent += arbiter.look(now)
        now = end
        if kind in TWISTS:
            due = arbiter.command(kind, TWISTS[kind] if moving else STOP, now)
            received[kind] = now
        elif kind in ("press", "release"):
            pressed = kind == "press"
            due = arbiter.emergency_stop(pressed, now)
        else:
            due = arbiter.look(now) if kind == "look" else arbiter.give_back(now)
        if pressed or kind not in TWISTS:
            assert set(due) <= {STOP}
        sent += due
        for before, after in zip(sent, sent[1:]):
            assert STOP in (before, after) or before == after, "two drivers without a zero between them"
        if sent and sent[-1] != STOP:
            name = next(name for name, twist in TWISTS.items() if twist == sent[-1])
            assert now - received[name] <= 0.5, "a driver that is silent"
