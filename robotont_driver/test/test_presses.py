"""Presses of the emergency stop from a machine behind a network that is slow, loses packets, or is cut."""

import time

import pytest
from presses import GOOD

from robotont_testing.harness import wait_for

pytestmark = [pytest.mark.timed, pytest.mark.parametrize("shared_presses", [("robot0",)], indirect=True)]
REGISTERED = 15.0  # [s] from when the master knows of a button until it is heard
CONNECTED = 2.0    # [s] from a press of one that is connected


@pytest.mark.parametrize("delay, loss", [(0.25, 0.0), *(pytest.param(*link, marks=pytest.mark.long) for link in (
    (0.01, 0.0), (0.5, 0.0), (1.0, 0.0), (0.01, 0.3), (0.25, 0.3)))])
def test_a_press_from_behind_a_slow_network_is_heard(presses, delay, loss):
    presses.link(delay, loss)
    first, second = (f"{which}_{1000 * delay:.0f}_{100 * loss:.0f}" for which in ("first", "second"))
    presses.start_button(first, words="true 5")
    wait_for(lambda: presses.when(first, "registered"), "the master's word", timeout=120.0)
    heard = presses.wait_for_press(first, timeout=90.0)
    print(f"heard {heard - presses.when(first, 'registered'):.1f} s behind its registration")
    presses.start_button(second)
    presses.wait_for_connection(second)
    presses.order(second, "true")
    after = presses.wait_for_press(second) - presses.when(second, "true")
    print(f"heard {after:.2f} s behind the press")
    if not loss or delay < 0.1:  # else TCP alone may take longer: it waits for a round trip before it sends again
        assert heard - presses.when(first, "registered") <= REGISTERED
        assert after <= CONNECTED


def test_the_late_false_of_an_old_connection_takes_back_nothing(presses):
    presses.link(*GOOD)
    presses.start_button("third")
    presses.wait_for_connection("third")
    presses.order("third", "true")
    presses.wait_for_press("third")
    presses.link(GOOD[0], 1.0)
    presses.order("third", "false")  # waits in the old connection
    presses.wait(8.0)  # the outage; TCP tries again 14 s after its begin
    presses.link(*GOOD)
    presses.wait(1.5)
    presses.order("third", "true")
    presses.wait(8.0)  # within which TCP brings what waited
    assert "/third" in presses.pressing()


def test_a_button_that_repeats_its_state_is_heard_at_once_behind_an_outage(presses):
    presses.link(*GOOD)
    presses.start_button("fourth", words="false 5")
    presses.wait_for_connection("fourth")
    presses.wait(1.0)
    presses.link(GOOD[0], 1.0)
    presses.wait(10.0)
    presses.link(*GOOD)
    presses.wait(1.0)
    presses.order("fourth", "true 5")
    pressed = time.monotonic()
    assert presses.wait_for_press("fourth") - pressed <= 1.0
