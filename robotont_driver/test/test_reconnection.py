from unittest.mock import Mock

import pytest

from robotont_driver.ros import reconnection, rospy_internals


@pytest.fixture
def own(monkeypatch):
    """This node, which takes the newest word on a topic only."""
    own = Mock()
    monkeypatch.setattr(reconnection, "Worker", Mock())
    monkeypatch.setattr(rospy_internals.rospy, "get_node_uri", lambda: "http://here")
    monkeypatch.setattr(rospy_internals.xmlrpc.client, "ServerProxy", lambda uri: own)
    return own


def watched(*uris):
    here = Mock(**{"getsockname.return_value": ("127.0.0.1", 1), "getpeername.return_value": ("127.0.0.1", 2)})
    topic = Mock(connections=[Mock(endpoint_id=uri, socket=here) for uri in uris])
    topic.remove_connection = topic.connections.remove
    subscriber = Mock(resolved_name="/cmd_vel", impl=topic)
    return subscriber, topic, reconnection.OutageWatch(newest=[subscriber])


def test_of_two_commanders_that_are_back_at_once_none_is_forgotten(own):
    subscriber, topic, watch = watched("http://one", "http://other", "http://two")
    for connection in topic.connections[::2]:
        watch._reconnect(connection.endpoint_id, [(subscriber, connection)])
    own.publisherUpdate.assert_called_with("/master", "/cmd_vel", ["http://one", "http://other", "http://two"])


def test_who_was_dropped_is_connected_again_once(own):
    _, topic, watch = watched("http://one", "http://other")
    watch._look()
    own.publisherUpdate.assert_not_called()
    topic.connections.pop(0)
    for _ in range(3):
        watch._look()
    own.publisherUpdate.assert_called_once_with("/master", "/cmd_vel", ["http://one", "http://other"])
