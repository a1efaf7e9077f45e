"""The rule of the emergency stop, over all orders in which nodes may speak."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.command.emergency_stop import EmergencyStop, StandFirst

NODES = ("/button", "/page", "/keys")
TIMEOUT = 0.5


class Ways:
    """What several nodes say, by connections that deliver in order, each late by any time; the truth to judge by.

    every: whether a node says each word to all its connections, as roscpp does, or to the newest, as rospy does.
    """

    def __init__(self, every):
        self.every = every
        self.stop = EmergencyStop()
        self.said = 0         # words so far
        self.made = 0         # connections so far
        self.ways = {}        # by node: [number, the words that wait in it] of each connection, the newest last
        self.newest = {}      # by node: the newest word of those heard
        self.presses = {}     # by node: (connection, connections made by then) of each press that was heard

    def connect(self, node):
        self.made += 1
        self.ways.setdefault(node, []).append([self.made, []])

    def say(self, node, pressed, latched):
        self.said += 1
        for _, waiting in self.ways.get(node, [])[0 if self.every else -1:]:
            waiting.append((self.said, pressed, latched))

    def restart(self, node):
        """Its process ends; what waits still comes."""
        for way in self.ways.get(node, []):
            way[1] = Closed(way[1])
        self.connect(node)

    def hear(self, node, which):
        ways = [way for way in self.ways.get(node, []) if way[1]]
        if not ways:
            return
        number, waiting = ways[which % len(ways)]
        word, pressed, latched = waiting.pop(0)
        before = self.stop.pressed_by
        assert self.stop.hear(node, pressed, latched, number, self.made) == (before != self.stop.pressed_by)
        presses = self.presses.setdefault(node, [])
        if pressed:
            presses.append((number, self.made))
        elif not latched:  # what is not in doubt is taken back
            presses[:] = [(by, made) for by, made in presses if number != by and number <= made]
        assert (node in self.stop.pressed_by) == bool(presses)
        if word > self.newest.get(node, (0,))[0] and (pressed or not latched):
            self.newest[node] = word, pressed

    def release(self):
        assert self.stop.release() == any(self.presses.values())
        self.newest.clear()
        self.presses.clear()

    def judge(self):
        for node, (_, pressed) in self.newest.items():
            assert not pressed or node in self.stop.pressed_by, "taken back by an older word"


class Closed(list):
    """The words that wait in a connection whose process has ended."""

    def append(self, _word):
        """No more come."""


@pytest.mark.parametrize("every", [True, False])
def test_no_press_is_taken_back_by_an_older_word_whatever_comes_late(every):
    for seed in range(200):
        chance, ways = random.Random(seed), Ways(every)
        for node in NODES:
            ways.connect(node)
        for _ in range(150):
            node, order = chance.choice(NODES), chance.choices(
                ("say", "hear", "connect", "restart", "release"), (40, 50, 6, 2, 2))[0]
            how = {"say": (node, chance.random() < 0.5, chance.random() < 0.2), "hear": (node, chance.randrange(4)),
                   "release": ()}.get(order, (node,))
            getattr(ways, order)(*how)
            ways.judge()


def test_the_late_false_of_an_old_connection_takes_nothing_back():
    stop = EmergencyStop()
    stop.hear("/button", True, False, 1, 1)
    stop.hear("/button", True, False, 2, 2)  # behind an outage, by a new connection
    assert not stop.hear("/button", False, False, 1, 2)
    assert not stop.hear("/button", False, False, None, 2), "of a connection that has ended meanwhile"
    assert stop.pressed_by == ("/button",)
    assert stop.hear("/button", False, False, 2, 2)


def test_a_new_connection_takes_back_what_was_heard_before_it_and_what_was_kept():
    stop = EmergencyStop(["/button", "/page"])
    assert stop.hear("/button", False, False, 1, 1)
    stop.hear("/page", True, False, 2, 3)
    assert not stop.hear("/page", False, False, 3, 3), "it was there at the press: its word may be older"
    assert stop.hear("/page", False, False, 4, 4)


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
            held = set(asked)
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


def test_who_drove_when_it_was_pressed_has_to_stop_first_where_the_process_ends_before_the_release():
    before = StandFirst(TIMEOUT)
    before.admits("/program", True, 0.9)
    before.press(1.0)
    before.admits("/program", True, 1.1)
    after = StandFirst(TIMEOUT, before.waiting(1.2), 4.0)
    after.press(4.0)
    after.release(5.0)  # and only then it is heard again, as on a slow network
    assert not after.admits("/program", True, 8.5)


def test_who_was_held_when_the_process_before_ended_has_to_stop_first():
    stand_first = StandFirst(TIMEOUT, ["/program"], 7.0)
    assert not stand_first.admits("/program", True, 7.1)
    assert stand_first.waiting(7.1) == ["/program"]
    assert stand_first.admits("/another", True, 7.1)
    assert stand_first.admits("/program", False, 7.2)
    assert stand_first.admits("/program", True, 7.3)


@pytest.mark.parametrize("silence, held", [(4.9, True), (5.0, False), (3600.0, False)])
def test_who_was_held_then_and_comes_5_s_later_has_begun_anew(silence, held):
    stand_first = StandFirst(TIMEOUT, ["/program"], 7.0)
    assert stand_first.admits("/program", True, 7.0 + silence) != held
    assert bool(stand_first.waiting(7.0 + silence)) == held


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
