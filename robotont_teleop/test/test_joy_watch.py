"""joy_watch beside what it does not hear of in time, and of two gamepads; without ROS."""

import io
import itertools
from unittest.mock import Mock

import pytest
from rospy.msg import deserialize_messages, serialize_message
from sensor_msgs.msg import Joy

from robotont_teleop.hand import joy_watch
from robotont_testing.bus import Bus

STOP, DEAD_MAN, RELEASE = 1, 4, 7


class Watch(Bus):
    """A JoyWatch, and who presses the emergency stop by it."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch, joy_watch)
        self.press, self.release, self.live = Mock(), Mock(), self.sent["joy/live"]
        monkeypatch.setattr(joy_watch, "EmergencyStopPublisher", lambda: Mock(press=self.press, release=self.release))
        joy_watch.JoyWatch({one.name: one.default for one in joy_watch.PARAMETERS})

    def pad(self, stick, *down, sender="/joy_node", after=0.05):
        """It tells its state; what goes on to be driven by."""
        self.now += after
        self.hear("joy", Joy(axes=[stick], buttons=[int(button in down) for button in range(11)]), sender)
        return self.live[-1].axes[0]

    def says(self):
        return self.reports["gamepad"]()[1]


@pytest.fixture
def watch(monkeypatch):
    return Watch(monkeypatch)


def test_a_pad_that_begins_with_both_buttons_down_releases_nothing_and_presses_by_its_stop(watch):
    watch.pad(0.0, RELEASE, DEAD_MAN)
    assert not watch.release.called
    watch.pad(0.0, DEAD_MAN)
    watch.pad(0.0, RELEASE, DEAD_MAN)
    assert watch.release.call_count == 1
    watch.pad(0.0, STOP, sender="/another")
    assert watch.press.call_count == 1


def test_a_tap_counts_that_is_over_when_it_is_heard(watch):
    """A STOP that was tapped while joy_watch was held up: as rospy hands on what has waited."""
    waiting, messages = io.BytesIO(), []
    for number, down in enumerate((0, 1, 0)):
        serialize_message(waiting, number, Joy(buttons=[down if button == STOP else 0 for button in range(11)]))
    deserialize_messages(waiting, messages, Joy, queue_size=watch.options["joy"]["queue_size"])
    for message in messages:
        watch.hear("joy", message)
    assert watch.press.call_count == 1
    assert not watch.live[-1].buttons[STOP]


def test_what_one_of_two_pads_tells_is_no_sign_of_the_other(watch):
    sticks = itertools.cycle((0.1, 0.2))
    watch.pad(0.0, DEAD_MAN, sender="/far")
    drove = []
    for _ in range(60):
        drove.append(watch.pad(0.5, DEAD_MAN, sender="/far"))
        assert watch.pad(next(sticks), DEAD_MAN, sender="/near") or len(drove) == 1
    assert drove[:15] == 15 * [0.5], "for 1.5 s"
    assert not any(drove[16:])
    assert "out of reach" in watch.says()
    for _ in range(3):
        watch.pad(0.0, STOP, sender="/far")
        watch.pad(0.0, sender="/near")
    assert watch.press.call_count == 1, "one press, not one with each message of the other"
    watch.pad(0.0, STOP, sender="")
    assert watch.press.call_count == 2, "one of who has not said his name, as other publishers than ROS' own may do"


def test_a_pad_whose_node_has_ended_is_out_of_reach_no_more(watch):
    for _ in range(40):
        watch.pad(0.5, DEAD_MAN, sender="/ended")
    assert "out of reach" in watch.says()
    for number in range(50):
        watch.pad(number / 50, DEAD_MAN)
    assert watch.says() == "a gamepad"


def test_an_axis_that_is_no_number_is_no_sign_of_life(watch):
    drove = [watch.pad(0.5, DEAD_MAN), *(watch.pad(float("nan"), DEAD_MAN) for _ in range(60))]
    assert drove[-1] == 0.0


def test_what_a_pad_tells_at_the_start_may_be_from_long_ago(watch):
    assert watch.pad(0.5, DEAD_MAN) == 0.0
    assert watch.pad(0.5, DEAD_MAN) == 0.0
    assert "out of reach" in watch.says()
    assert watch.pad(0.6, DEAD_MAN) == 0.6


@pytest.mark.parametrize("gap", [0.05, 10.0])
def test_a_release_that_waited_for_this_process_is_not_carried_out(watch, gap):
    assert watch.says().startswith("no gamepad")
    for _ in range(10):
        watch.pad(0.0)
    assert watch.says() == "a gamepad"
    watch.pad(0.0, RELEASE)
    assert not watch.release.called, "a single button releases nothing"
    watch.pad(0.0, DEAD_MAN, after=gap)
    watch.pad(0.0, DEAD_MAN, RELEASE, after=0.001)
    assert watch.release.call_count == (gap < 1.0)
    watch.pad(0.0, DEAD_MAN, after=0.4)
    watch.pad(0.0, DEAD_MAN, RELEASE)
    assert watch.release.call_count == 1 + (gap < 1.0)
