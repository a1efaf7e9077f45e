from unittest.mock import Mock

from robotont_driver.ros import reconnection


def test_of_two_commanders_that_are_back_at_once_none_is_forgotten(monkeypatch):
    """rospy takes the newest word on a topic only."""
    own = Mock()
    monkeypatch.setattr(reconnection, "Worker", Mock())
    monkeypatch.setattr(reconnection.rospy, "get_node_uri", lambda: "http://here")
    monkeypatch.setattr(reconnection.xmlrpc.client, "ServerProxy", lambda uri: own)
    topic = Mock(resolved_name="/cmd_vel", connections=[
        Mock(endpoint_id=uri) for uri in ("http://one", "http://other", "http://two")])
    topic.remove_connection = topic.connections.remove
    watch = reconnection.OutageWatch(newest=[Mock(impl=topic)])
    for connection in topic.connections[::2]:
        watch._reconnect(connection.endpoint_id, [(topic, connection)])
    own.publisherUpdate.assert_called_with("/master", "/cmd_vel", ["http://one", "http://other", "http://two"])
