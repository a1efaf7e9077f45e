from unittest.mock import Mock

from robotont_driver.ros import reconnection, rospy_internals


def test_of_two_commanders_that_are_back_at_once_none_is_forgotten(monkeypatch):
    """rospy takes the newest word on a topic only."""
    own = Mock()
    monkeypatch.setattr(reconnection, "Worker", Mock())
    monkeypatch.setattr(rospy_internals.rospy, "get_node_uri", lambda: "http://here")
    monkeypatch.setattr(rospy_internals.xmlrpc.client, "ServerProxy", lambda uri: own)
    topic = Mock(connections=[Mock(endpoint_id=uri) for uri in ("http://one", "http://other", "http://two")])
    topic.remove_connection = topic.connections.remove
    subscriber = Mock(resolved_name="/cmd_vel", impl=topic)
    watch = reconnection.OutageWatch(newest=[subscriber])
    for connection in topic.connections[::2]:
        watch._reconnect(connection.endpoint_id, [(subscriber, connection)])
    own.publisherUpdate.assert_called_with("/master", "/cmd_vel", ["http://one", "http://other", "http://two"])
