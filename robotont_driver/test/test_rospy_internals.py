"""What is used of rospy, actionlib and tornado beside their public interface: still there, and in one place."""

import ast
import inspect
import threading
from pathlib import Path

import actionlib
import pytest
import rospy
from rosgraph.xmlrpc import ThreadingXMLRPCServer, XmlRpcHandler, XmlRpcNode
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSServer, TCPROSTransport
from rospy.impl.transport import Transport
from rospy.topics import Publisher, Subscriber, _PublisherImpl, _SubscriberImpl

from robotont_driver.ros import rospy_internals
from robotont_testing.harness import wait_for

PROJECT = Path(__file__).resolve().parents[2]
HOMES = {"rospy_internals.py", "page_frames.py"}
PUBLIC = {"_replace", "_asdict", "_fields", "_make",  # of named tuples
          "_exit"}                                    # of os
INTERNAL = {"impl", "gh", "ws_connection", "service_actions", "endpoint_id"}
SOURCES = [path for path in sorted(PROJECT.glob("robotont_*/src/*/**/*.py"))
           if path.name not in HOMES and "robotont_testing" not in path.parts]


def foreign_parts(tree):
    """Names of private attributes of objects whose class is not in this module, and of known internal ones."""
    own = {node.name for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    attributes = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)]
    own |= {node.attr for node in attributes if isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")}
    names = {node.attr for node in attributes}
    private = {name for name in names if name.startswith("_") and not name.endswith("__")}
    return private - own - PUBLIC | names & INTERNAL


def test_no_other_module_uses_what_is_not_public():
    found = {path.name: foreign_parts(ast.parse(path.read_text())) for path in SOURCES}
    assert {name: parts for name, parts in found.items() if parts} == {
        "reconnection.py": {"endpoint_id"},  # a connection's own name: compared, and put aside
        "log_queue.py": {"_thread"},         # of Python's QueueListener
    }


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
