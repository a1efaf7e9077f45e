"""The rule of the emergency stop, over all orders in which nodes may speak."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.command.emergency_stop import EmergencyStop, StandFirst

NODES = ("/button", "/page", "/keys")
TIMEOUT = 0.5


def words():
    """What may happen: a node says something, latched or not; a person releases; the node that follows restarts."""
    said = st.tuples(st.just("say"), st.sampled_from(NODES), st.booleans(), st.booleans())
    return st.lists(st.one_of(said, st.just(("release",)), st.just(("restart",))), max_size=40)


@given(words())
def test_the_robot_stands_from_each_press_until_that_node_or_a_person_takes_it_back(history):
    stop = EmergencyStop()
    for number, (what, *how) in enumerate(history):
        before = stop.pressed_by
        if what == "restart":
            stop = EmergencyStop(list(before))
        else:
            assert (stop.hear(*how) if what == "say" else stop.release()) == (stop.pressed_by != before)
        presses = {node for node in NODES if presses_still(node, history[:number + 1])}
        assert set(stop.pressed_by) == presses
        assert stop.pressed == bool(presses)


def presses_still(node, history):
    """The rule once more, from the end: the newest of what concerns this node's press decides."""
    for what, *how in reversed(history):
        if what == "release":
            return False
        if what == "say" and how[0] == node and (how[1] or not how[2]):
            return how[1]
    return False


@pytest.mark.parametrize("kept, pressed_by", [
    ((), ()), (False, ()), ([], ()), (["/page"], ("/page",)), (True, ("somebody",)), ({"a": 1}, ("somebody",)),
    ("yes", ("somebody",)),
])
def test_what_was_kept_is_believed_where_it_is_in_doubt(kept, pressed_by):
    assert EmergencyStop(kept).pressed_by == pressed_by


SENDERS = ("/navigation", "/web_teleop_node")


@given(st.lists(st.tuples(st.sampled_from([*SENDERS, "press", "release"]), st.booleans(), st.floats(0.001, 1.0)),
                max_size=40))
def test_who_has_asked_for_motion_drives_after_a_release_only_after_a_stop_of_his_own(history):
    stand_first = StandFirst(TIMEOUT)
    now, asked, held = 0.0, {}, set()
    for who, moves, pause in history:
        now += pause
        if who == "press":
            stand_first.press(now)
            asked = {sender: at for sender, at in asked.items() if now - at < TIMEOUT}
            held = held & set(asked)
        elif who == "release":
            stand_first.release(now)
            asked = dict.fromkeys(asked, now)
            held = set(asked)
        else:
            if not moves or now - asked.get(who, now) >= TIMEOUT:
                held.discard(who)
            assert stand_first.admits(who, moves, now) == (who not in held)
            asked.pop(who, None)
            if moves:
                asked[who] = now
        assert stand_first.waiting(now) == sorted(sender for sender in held if now - asked[sender] < TIMEOUT)


def test_exactly_the_time_out_of_silence_is_a_stop():
    for pressed, held in ((TIMEOUT, False), (TIMEOUT - 0.01, True)):  # after his newest wish
        stand_first = StandFirst(TIMEOUT)
        stand_first.admits("/web_teleop_node", True, 0.0)
        stand_first.press(pressed)
        stand_first.release(1.0)
        assert bool(stand_first.waiting(1.0)) == held
        assert stand_first.admits("/web_teleop_node", True, 1.125) != held
    assert stand_first.waiting(1.5) == ["/web_teleop_node"]
    assert stand_first.waiting(1.125 + TIMEOUT) == []
    assert not stand_first.admits("/web_teleop_node", True, 1.5)
    assert stand_first.admits("/web_teleop_node", True, 1.5 + TIMEOUT)
    stop = EmergencyStop(["/keys"])
    assert stop.hear("/keys", False), "what is not said to be latched is not"
