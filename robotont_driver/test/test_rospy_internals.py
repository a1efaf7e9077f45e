"""What is used of rospy and actionlib beside their public interface is still there."""

import inspect
import socket
import threading

import actionlib
import pytest
import rospy
from actionlib.action_client import CommStateMachine
from rospy.impl import transport
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSServer, TCPROSTransport
from rospy.impl.transport import Transport
from rospy.topics import Publisher, Subscriber, _PublisherImpl, _SubscriberImpl, _TopicManager

from robotont_driver.rospy_repairs import rospy_internals
from robotont_testing.harness import wait_for


@pytest.mark.parametrize("owner, names", [
    (_PublisherImpl, ["acquire", "release", "publish"]),
    (_SubscriberImpl, ["remove_connection"]),
    (Transport, ["fileno", "close"]),
    (TCPROSServer, ["_tcp_server_callback"]),
    (RegManager, ["_connect_topic_thread"]),
    (_TopicManager, ["get_subscriber_impl"]),
])
def test_a_part_is_still_there(owner, names):
    assert not [name for name in names if not callable(getattr(owner, name, None))]


@pytest.mark.parametrize("function, words", [
    (Publisher.__init__, ["self.impl"]),
    (Subscriber.__init__, ["self.impl"]),
    (rospy.AnyMsg.deserialize, ["self._buff"]),
    (TCPROSTransport.receive_once, ["_connection_header"]),
    (transport._nextId, ["_transport_id += 1"]),
    (_PublisherImpl.publish, ["connection_override"]),
    (actionlib.ClientGoalHandle.__init__, ["self.comm_state_machine"]),
    (CommStateMachine.__init__, ["self.action_goal"]),
])
def test_a_part_is_still_set_or_taken(function, words):
    assert not [word for word in words if word not in inspect.getsource(function)]


def test_a_publisher_that_is_named_twice_at_once_is_connected_to_once_at_a_time(monkeypatch):
    asking, most, done = threading.Event(), [], threading.Event()

    def connect(*_):
        most.append(1)
        asking.set()
        done.wait(10.0)
    monkeypatch.setattr(RegManager, "_connect_topic_thread", connect)
    rospy_internals._connect_once_at_a_time.__wrapped__()

    def named():
        RegManager._connect_topic_thread(None, "topic", "http://robot:1")
    first = threading.Thread(target=named)
    first.start()
    asking.wait(10.0)
    named()  # returns at once
    done.set()
    first.join()
    assert len(most) == 1
    named()
    assert len(most) == 2, "the next time it is asked again"


def test_of_those_who_connect_and_say_nothing_the_first_have_to_go(monkeypatch):
    heard = []

    def hear(_server, connection, _address):
        heard.append(connection.recv(1))
    monkeypatch.setattr(TCPROSServer, "_tcp_server_callback", hear)
    rospy_internals._hear_all_who_connect.__wrapped__()
    pairs = [socket.socketpair() for _ in range(rospy_internals.MOST_SILENT + 3)]
    for ours, _ in pairs:
        TCPROSServer._tcp_server_callback(None, ours, "")
    wait_for(lambda: len(heard) == 3, "the end of the first three")
    pairs[-1][1].sendall(b"x")
    wait_for(lambda: heard == [b"", b"", b"", b"x"], "the newest")
    for _, theirs in pairs:
        theirs.close()
