"""Held keys, in virtual time."""

import math
import string

import pytest

from robotont_teleop.hand.held_keys import RELEASE, SPEED_KEYS, HeldKeys, keys_of_now, split_keys
from robotont_teleop.hand.speeds import STOP, Speeds

SPEEDS = Speeds(0.3, 1.0)


@pytest.fixture
def keys():
    return HeldKeys(SPEEDS, Speeds(0.5, 2.0), first=0.75, repeat=0.3)


@pytest.mark.parametrize("key, twist", [
    ("w", (0.3, 0, 0)), ("s", (-0.3, 0, 0)), ("a", (0, 0.3, 0)), ("d", (0, -0.3, 0)), ("q", (0, 0, 1)),
    ("e", (0, 0, -1)), ("up", (0.3, 0, 0)), ("down", (-0.3, 0, 0)), ("left", (0, 0, 1)), ("right", (0, 0, -1))])
def test_every_movement_key(keys, key, twist):
    assert keys.press(key, 1.0)
    assert keys.twist(1.0) == twist


def test_a_diagonal_is_no_faster(keys):
    keys.press("w", 1.0)
    keys.press("a", 1.0)
    assert math.hypot(*keys.twist(1.0)) == pytest.approx(0.3)


def test_a_tap_outlasts_the_delay_before_a_keyboard_repeats(keys):
    keys.press("w", 1.0)
    assert keys.twist(1.74) != STOP
    assert keys.twist(1.75) == STOP


def test_a_held_key_stops_soon_after_its_release(keys):
    keys.press("w", 1.0)
    for step in range(10):
        keys.press("w", 1.66 + step * 0.04)
    assert keys.twist(2.3) != STOP
    assert keys.twist(1.66 + 0.36 + 0.301) == STOP


def test_the_opposite_key_stops_and_then_reverses(keys):
    keys.press("w", 1.0)
    keys.press("s", 1.1)
    assert keys.twist(1.1) == STOP
    keys.press("s", 1.2)
    assert keys.twist(1.2) == (-0.3, 0.0, 0.0)


def test_speeds(keys):
    for key in SPEED_KEYS:
        assert keys.press(key, 1.0)
    assert keys.speeds.linear == pytest.approx(0.33)
    for key, speeds in (("+", (0.5, 2.0)), ("-", (0.005, 0.02))):
        for _ in range(200):
            keys.press(key, 1.0)
        assert keys.speeds == pytest.approx(speeds)


@pytest.mark.parametrize("text, keys_, rest", [
    ("w", ["w"], ""), ("ww ", ["w", "w", " "], ""), ("\x1b[A\x1b[D", ["up", "left"], ""), ("\x1bOC", ["right"], ""),
    ("\x1b", ["\x1b"], ""), ("\x1b[", [], "\x1b["), ("\x1b[1;5A", ["other"], ""), ("\x1b[3~w", ["other", "w"], ""),
    ("WaQU\x1b[A", ["w", "a", "q", "u", "up"], ""),  # Caps Lock
    ("\x1b[" + 20 * "1" + "\x1b[A", ["other", "up"], ""), ("\x15", [RELEASE], ""),
    ("\x1b[ ", ["other", " "], ""), ("\x1bO  w", ["other", " ", " ", "w"], "")])  # Alt-[, Alt-O, and then STOP
def test_keys_of_a_terminal(text, keys_, rest):
    assert split_keys(text) == (keys_, rest)


def test_no_letter_releases_the_emergency_stop():
    assert RELEASE not in split_keys(string.ascii_letters + string.digits + string.punctuation)[0]


def test_of_keys_that_have_waited_only_those_count_that_stop():
    typed = ["w", RELEASE, "w", " ", "\x1b"]
    assert keys_of_now(typed, settled=True) == typed
    assert keys_of_now(["\x1b", *typed], settled=True) == [*typed[:-1], "\x1b", "\x1b"]
    assert keys_of_now(typed, settled=False) == [" ", "\x1b"]
    assert keys_of_now(3 * typed, settled=True) == 3 * [" "] + 3 * ["\x1b"]
