"""Packets between nodes of one process; between processes the rostests of the nodes show them."""

import pytest

from robotont_driver.protocol.packet import Packet, parse_packet
from robotont_driver.ros import packet_topics
from robotont_driver.ros.packet_topics import SharedPacketTopic


class FakePublisher:
    """A publisher with so many `listeners`."""

    listeners, published = 0, []  # of all of them

    def __init__(self, *_, **__):
        self.published.clear()

    def get_num_connections(self):
        return self.listeners

    def publish(self, text):
        self.published.append(text)


@pytest.fixture
def errors(monkeypatch):
    """What is logged as an error; no ROS master is needed."""
    logged = []
    monkeypatch.setattr(packet_topics.rospy, "Publisher", FakePublisher)
    monkeypatch.setattr(packet_topics.rospy, "logerr", lambda text, *values: logged.append(text % values))
    return logged


def shared_topic(*subscribers):
    topic = SharedPacketTopic("serial_read")
    topic.advertise()
    for taken in subscribers:
        topic.subscribe(3, taken)
    return topic


def test_a_subscriber_that_fails_ends_neither_the_thread_nor_the_others(errors):
    def fail(_packet):
        raise ValueError("a fault")
    got = []
    topic = shared_topic(fail, got.append)
    packet = Packet([1, 2, 3])
    for _ in range(2):
        topic.publish(packet)
    assert [given is packet for given in got] == [True, True]
    assert len(errors) == 2
    assert "serial_read" in errors[0]
    assert "a fault" in errors[0]


def test_other_processes_get_a_copy_when_they_listen(errors, monkeypatch):
    topic = shared_topic()
    topic.publish(Packet([1, 2, 3]))
    assert not FakePublisher.published
    monkeypatch.setattr(FakePublisher, "listeners", 1)
    topic.publish(Packet([1, 2, 3]))
    topic.publish(parse_packet("0:1.5:-1.5;\n", 3))  # as it was written
    assert FakePublisher.published == ["1:2:3;\n", "0:1.5:-1.5;\n"]
