"""What is used of rospy and actionlib beside their public interface is still there."""

import inspect
import threading
import time

import actionlib
import pytest
import rospy
from rosgraph.xmlrpc import ThreadingXMLRPCServer, XmlRpcHandler, XmlRpcNode
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSServer, TCPROSTransport
from rospy.impl.transport import Transport
from rospy.topics import Publisher, Subscriber, _PublisherImpl, _SubscriberImpl

from robotont_driver.rospy_repairs import rospy_internals
from robotont_testing.harness import wait_for


@pytest.mark.parametrize("owner, names", [
    (_PublisherImpl, ["acquire", "release", "publish", "add_subscriber_listener"]),
    (_SubscriberImpl, ["remove_connection"]),
    (Transport, ["fileno", "close"]),
    (ThreadingXMLRPCServer, ["service_actions"]),
    (TCPROSServer, ["_tcp_server_callback"]),
    (RegManager, ["_connect_topic_thread"]),
])
def test_a_part_is_still_there(owner, names):
    assert not [name for name in names if not callable(getattr(owner, name, None))]


@pytest.mark.parametrize("function, words", [
    (Publisher.__init__, ["self.impl"]),
    (Subscriber.__init__, ["self.impl"]),
    (rospy.AnyMsg.deserialize, ["self._buff"]),
    (TCPROSTransport.receive_once, ["_connection_header"]),
    (_PublisherImpl.publish, ["connection_override"]),
    (actionlib.SimpleActionClient.send_goal, ["self.gh"]),
])
def test_a_part_is_still_set_or_taken(function, words):
    assert not [word for word in words if word not in inspect.getsource(function)]


def test_the_server_of_a_node_ends_with_its_socket(monkeypatch):
    monkeypatch.setattr(ThreadingXMLRPCServer, "service_actions", rospy_internals._end_without_socket)
    node = XmlRpcNode(rpc_handler=XmlRpcHandler())
    thread = threading.Thread(target=node.run, daemon=True)
    thread.start()
    wait_for(lambda: node.uri, "the server")
    node.shutdown("it is enough")
    thread.join(5.0)
    assert not thread.is_alive()


def test_a_publisher_that_is_named_twice_at_once_is_connected_to_once_at_a_time(monkeypatch):
    asking, most = [], []

    def connect(_manager, _topic, _uri):
        asking.append(1)
        most.append(len(asking))
        time.sleep(0.2)  # the second one must not come meanwhile
        asking.pop()
    monkeypatch.setattr(RegManager, "_connect_topic_thread", connect)
    monkeypatch.setattr(rospy_internals, "within_reach", lambda _: True)
    rospy_internals._connect_when_within_reach.__wrapped__()
    threads = [threading.Thread(target=RegManager._connect_topic_thread, args=(None, "topic", "http://robot:1"))
               for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1, 1]
