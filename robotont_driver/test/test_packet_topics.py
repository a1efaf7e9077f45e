"""Packets between nodes of one process; that others get copies, and packets between processes, the rostests show."""

from unittest.mock import Mock

from robotont_driver.protocol.protocol import Packet
from robotont_driver.ros import packet_topics


def test_a_subscriber_that_fails_ends_neither_the_thread_nor_the_others(monkeypatch):
    def fail(_packet):
        raise ValueError("a fault")
    got, errors = [], []
    monkeypatch.setattr(packet_topics.rospy, "Publisher", Mock())
    monkeypatch.setattr(packet_topics.rospy, "logerr", lambda text, *values: errors.append(text % values))
    topic = packet_topics.SharedPacketTopic("serial_read")
    publish = topic.advertise()
    topic.subscribe(3, fail)
    topic.subscribe(3, got.append)
    packet = Packet([1, 2, 3])
    for _ in range(2):
        publish(packet)
    assert [given is packet for given in got] == [True, True]
    assert len(errors) == 2
    assert "serial_read" in errors[0]
    assert "a fault" in errors[0]
