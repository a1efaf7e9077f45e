"""When a robot counts as held, by what is commanded and what its wheels measure."""

import pytest

from robotont_map_navigation.hold_watch import HELD, HoldWatch

AHEAD = 0.2, 0.0, 0.0


def held_after(commanded, measured, seconds=4.0, silent=(0.0, 0.0)):
    """[s] until words come when measured(t) is fed 50 times per second, no odom within `silent`; None: never."""
    watch = HoldWatch(0.19)
    for period in range(int(seconds * 50)):
        now = period / 50
        if period % 3 == 0:
            watch.command(commanded(now), now)
        if not silent[0] <= now < silent[1] and watch.measure(measured(now), now):
            return now
    return None


@pytest.mark.parametrize("commanded", [AHEAD, (0.0, -0.1, 0.0), (0.05, 0.0, 0.0), (0.0, 0.0, 0.5), (0.1, 0.1, -1.0)])
@pytest.mark.parametrize("share", [0.0, -0.5, 0.2])
def test_a_robot_that_does_not_move_as_commanded_is_held_after_a_second(commanded, share):
    found = held_after(lambda now: commanded, lambda now: tuple(share * speed for speed in commanded))
    assert HELD <= found < HELD + 0.05


@pytest.mark.parametrize("measured", [
    lambda now: (0.2 * min(1.0, now / 0.6), 0.0, 0.0),         # a slow start
    lambda now: (0.0, 0.0, 0.0) if 1.0 < now < 1.8 else AHEAD,  # a threshold that it got over
    lambda now: (0.1, 0.05, 0.3)])                              # slower, and not straight
def test_a_robot_that_moves_is_not_held(measured):
    assert held_after(lambda now: AHEAD, measured) is None


def test_commands_that_ask_for_nothing_prove_nothing():
    assert held_after(lambda now: (0.02, 0.0, 0.05), lambda now: (0.0, 0.0, 0.0)) is None


def test_without_odometry_nothing_is_known_and_the_second_begins_anew():
    assert held_after(lambda now: AHEAD, lambda now: (0.0, 0.0, 0.0), silent=(0.5, 1.5)) >= 1.5 + HELD
