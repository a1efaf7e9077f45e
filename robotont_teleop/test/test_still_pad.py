"""A gamepad that is out of reach, in virtual time and as joy_watch of gamepad.launch meets it."""

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Joy
from std_msgs.msg import String

from robotont_driver.ros.worker import Worker
from robotont_teleop.hand.still_pad import StillPad
from robotont_testing import places
from robotont_testing.harness import Master, in_own_process, wait_for
from robotont_testing.robots import WHEEL_PARAMS

DEAD_MAN, STOP, RELEASE = 4, 1, 7


def test_what_does_not_change_is_gone_and_any_change_brings_it_back():
    pad = StillPad(1.5)
    assert not pad.hear(((0.4,), (1,)), 9.0), "it may have been so for long"
    assert pad.hear(((0.5,), (1,)), 10.0)
    assert pad.hear(((0.5,), (1,)), 11.4)
    assert not pad.hear(((0.5,), (1,)), 11.5)
    assert not pad.hear(((0.5,), (1,)), 99.0)
    assert pad.hear(((0.51,), (1,)), 99.1)


@in_own_process
def test_joy_watch_lets_a_pad_go_that_may_be_gone_and_stops_by_its_button():
    with Master() as master:
        master.load(WHEEL_PARAMS)
        rospy.init_node("joy", disable_signals=True)
        live, words, pressed_by = [], [], []
        pad = Joy(axes=[0.0] * 6, buttons=[0] * 11)
        publisher = rospy.Publisher("joy", Joy, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("joy/live", Joy, live.append)
        rospy.Subscriber("emergency_stop/pressed_by", String, lambda message: pressed_by.append(message.data))
        rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: words.extend(
            status.message for status in message.status if status.name == "joy_watch: gamepad"))
        Worker(lambda: publisher.publish(pad) or 0.05)  # as joy_node repeats it, whether the pad is there or not
        master.node("driver_node")
        master.start(places.program("robotont_teleop", "joy_watch"), "_longest_still:=0.5")
        wait_for(lambda: live and "a gamepad" in words, "the pad")

        def sees(axis, button):
            heard = len(live)
            wait_for(lambda: len(live) > heard + 1, "the pad of now")
            wait_for(lambda: (live[-1].axes[1], live[-1].buttons[DEAD_MAN]) == (axis, button), f"{axis} {button}")
        pad.axes[1], pad.buttons[DEAD_MAN] = 0.5, 1
        sees(0.5, 1)
        sees(0.0, 0)
        wait_for(lambda: words[-1].startswith("the gamepad is still, or out of reach"), "words")
        pad.axes[1] = 0.625
        sees(0.625, 1)
        wait_for(lambda: words[-1] == "a gamepad", "words that it is there")
        pad.buttons[STOP] = 1
        wait_for(lambda: pressed_by[-1:] == ["/joy_watch"], "the press")
        pad.buttons[STOP] = pad.buttons[DEAD_MAN] = 0
        pad.buttons[RELEASE] = 1
        sees(0.625, 0)
        pad.buttons[RELEASE] = 0
        sees(0.625, 0)
        assert pressed_by[-1] == "/joy_watch", "a single button releases nothing"
        pad.buttons[DEAD_MAN] = pad.buttons[RELEASE] = 1
        wait_for(lambda: not pressed_by[-1], "the release")
