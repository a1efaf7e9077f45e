"""Histories of presses of the emergency stop from a machine behind a network that is slow, loses packets, or is cut."""

import contextlib
import random
import time

import pytest
from presses import GOOD

from robotont_testing.harness import wait_for

FEW, MANY = [tuple(f"robot{number}" for number in range(amount)) for amount in (2, 8)]
SETTLED = 30.0  # [s] within which a good network brings all that waited: TCP tries again after twice the time of before


def history(presses, robots, chance):
    """One of each robot, at once, with the same network: presses and their releases, cuts, slow links, restarts.

    Returns the newest word by button.
    """
    model, cut_until, end = {}, 0.0, time.monotonic() + 12.0
    while time.monotonic() < end:
        robot = chance.choice(robots)
        button, what = f"{robot}_{chance.choice('ab')}", chance.random()
        if what < 0.7 and presses.when(button, "connected"):
            model[button] = chance.choice(("true", "false"))
            presses.order(button, model[button])
        elif what < 0.75:
            presses.start_button(button, robot)
            model.pop(button, None)  # what was said may be lost with it
        elif time.monotonic() > cut_until and what < 0.85:
            cut_until = time.monotonic() + chance.uniform(0.3, 5.0)
            presses.link(GOOD[0], 1.0)
        elif time.monotonic() > cut_until:
            presses.link(chance.choice((0.01, 0.1, 0.25)), chance.choice((0.0, 0.0, 0.2)))
        presses.wait(chance.uniform(0.0, 0.3))
    presses.link(*GOOD)
    return model


@pytest.mark.timed
@pytest.mark.parametrize("shared_presses, robots, seeds", [
    (FEW, FEW, range(1)), pytest.param(MANY, MANY, range(1, 26), marks=pytest.mark.long)], indirect=["shared_presses"],
    ids=["2 histories", "200 histories"])
def test_histories_of_buttons_on_a_network_that_is_cut_and_slow(presses, robots, seeds):
    """Whose newest word is a press presses, when all has come; seeds are printed."""
    buttons = [(robot, f"{robot}_{side}") for robot in robots for side in "ab"]
    for robot, button in buttons:
        presses.start_button(button, robot)
    for _, button in buttons:
        presses.wait_for_connection(button)
    for seed in seeds:
        model = history(presses, robots, random.Random(seed))
        pressed = [button for button, word in model.items() if word == "true" and not presses.when(button, "ended")]

        def lost(pressed=pressed):
            return [button for button in pressed if f"/{button}" not in presses.pressing(button[:-2])]
        begun = time.monotonic()
        with contextlib.suppress(AssertionError):
            wait_for(lambda: not lost(), "the presses", timeout=SETTLED, period=0.1)
        assert not lost(), f"lost, seed {seed}"
        settled = time.monotonic() - begun
        presses.wait(4.0)  # what is late would take them back
        assert not lost(), f"taken back, seed {seed}"
        held = [button for button, word in model.items() if word == "false" and
                f"/{button}" in presses.pressing(button[:-2])]
        print(f"seed {seed}: {len(pressed)} of {len(model)} press, all heard after {settled:.1f} s; "
              f"held in doubt: {len(held)}", flush=True)
