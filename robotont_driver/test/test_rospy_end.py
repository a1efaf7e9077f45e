"""The XML-RPC server of a rospy process, as the process ends."""

import threading

from rosgraph.xmlrpc import ThreadingXMLRPCServer, XmlRpcHandler, XmlRpcNode

from robotont_driver.ros import rospy_end
from robotont_testing.harness import wait_for


def test_a_server_ends_with_its_socket(monkeypatch):
    monkeypatch.setattr(ThreadingXMLRPCServer, "service_actions", ThreadingXMLRPCServer.service_actions)  # restore it
    rospy_end._end_servers_with_their_sockets()
    node = XmlRpcNode(rpc_handler=XmlRpcHandler())
    thread = threading.Thread(target=node.run, daemon=True)
    thread.start()
    wait_for(lambda: node.uri, "the server")
    node.shutdown("it is enough")
    thread.join(5.0)
    assert not thread.is_alive()
