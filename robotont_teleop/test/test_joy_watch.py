"""A STOP that was tapped while joy_watch was held up: as rospy hands on what has waited; without ROS."""

import io
from types import SimpleNamespace

from rospy.msg import deserialize_messages, serialize_message
from sensor_msgs.msg import Joy

from robotont_teleop.hand import joy_watch

STOP = 1


def test_a_tap_counts_that_is_over_when_it_is_heard(monkeypatch):
    presses, subscribed, live = [], [], []
    monkeypatch.setattr(joy_watch, "EmergencyStopPublisher", lambda: SimpleNamespace(press=lambda: presses.append(1)))
    monkeypatch.setattr(joy_watch, "Health", lambda *_: None)
    monkeypatch.setattr(joy_watch, "robot_name", str)
    monkeypatch.setattr(joy_watch.rospy, "Publisher", lambda *_, **__: SimpleNamespace(publish=live.append))
    monkeypatch.setattr(joy_watch.rospy, "Subscriber", lambda *given, **options: subscribed.append((*given, options)))
    joy_watch.JoyWatch({one.name: one.default for one in joy_watch.PARAMETERS})
    (_, kind, heard, options), = subscribed
    waiting, messages = io.BytesIO(), []
    for number, down in enumerate((0, 1, 0)):
        serialize_message(waiting, number, Joy(buttons=[down if button == STOP else 0 for button in range(11)]))
    deserialize_messages(waiting, messages, kind, queue_size=options["queue_size"])
    for message in messages:
        heard(message)
    assert len(presses) == 1
    assert not live[-1].buttons[STOP]
