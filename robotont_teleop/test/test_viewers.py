"""Viewers by Foxglove's protocol: who may look, and what a rude or slow one does to others."""

import json
import struct

import pytest
from tornado.httpclient import HTTPClientError
from web_client import TOKEN, Connection

from robotont_testing.harness import wait_for

SCAN = ("/scan", "sensor_msgs/LaserScan", "float32[] ranges")
MAP = ("/map", "nav_msgs/OccupancyGrid", "int8[] data")


class Viewer(Connection):
    def __init__(self, served, query="", origin=None, protocol="foxglove.websocket.v1"):
        self.told, self.data = [], []
        super().__init__(served, "/foxglove" + query, {"Origin": origin} if origin else {}, subprotocols=[protocol])

    def take(self, message):
        if isinstance(message, bytes):
            self.data.append((struct.unpack("<BIQ", message[:13])[1], message[13:]))
        else:
            self.told.append(json.loads(message))

    def newest(self, operation):
        return next((one for one in reversed(self.told) if one["op"] == operation), None)

    def channels(self):
        return {channel["topic"]: channel for told in self.told if told["op"] == "advertise"
                for channel in told["channels"]}

    def subscribe(self, topic, number):
        channel = wait_for(lambda: self.channels().get(topic), topic)
        self.send({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channel["id"]}]})


@pytest.fixture
def topics(served):
    return served.server.channels.topics


@pytest.mark.parametrize("query, origin", [("", None), ("?token=wrong", None), ("?token=wrong", "http://localhost")])
def test_in_the_network_nobody_looks_without_the_token(guarded, query, origin):
    with pytest.raises(HTTPClientError, match="401"):
        Viewer(guarded, query, origin)


def test_with_the_token_any_viewer_looks_also_after_many_tries_without_one(guarded):
    for _ in range(6):  # a viewer tries again and again
        with pytest.raises(HTTPClientError, match="401"):
            Viewer(guarded, "", None)
    viewer = Viewer(guarded, f"?token={TOKEN}", "https://app.foxglove.dev")
    assert wait_for(lambda: viewer.newest("serverInfo"), "the server's word")["capabilities"] == ["parameters"]


def test_without_a_token_only_sites_of_this_computer_look_by_our_protocol(served):
    viewer = Viewer(served, protocol="foxglove.websocket.v9")
    wait_for(lambda: viewer.closed, "the end")
    for origin in (None, "http://localhost:8080"):
        viewer = Viewer(served, origin=origin)
        wait_for(lambda viewer=viewer: viewer.told, "the server's word")
    for origin in ("https://evil.example", "null"):
        with pytest.raises(HTTPClientError, match="403"):
            Viewer(served, origin=origin)


def test_topics_are_subscribed_while_somebody_looks(served, topics):
    assert not topics.wanted()
    one, other = Viewer(served), Viewer(served)
    wait_for(lambda: topics.wanted(), "the subscriptions")
    one.close()
    topics.hear(*SCAN, b"1", False)
    wait_for(lambda: other.channels(), "a channel")
    other.close()
    wait_for(lambda: not topics.wanted(), "the end of the subscriptions")


def test_messages_reach_those_who_subscribe_and_latched_ones_those_who_come_later(served, topics):
    one = Viewer(served)
    wait_for(lambda: topics.wanted(), "the subscriptions")
    topics.hear(*MAP, b"map", True)
    topics.hear(*SCAN, b"old", False)
    one.subscribe("/scan", 7)
    wait_for(lambda: topics.hear(*SCAN, b"new", False) or (7, b"new") in one.data, "a scan")
    late = Viewer(served)
    late.subscribe("/map", 3)
    wait_for(lambda: late.data == [(3, b"map")], "the map")
    assert {number for number, _ in one.data} == {7}
    one.send({"op": "unsubscribe", "subscriptionIds": [7]},
             {"op": "getParameters", "parameterNames": ["/robot_description"], "id": "a"})
    answer = wait_for(lambda: one.newest("parameterValues"), "the model")
    assert (answer["id"], answer["parameters"]) == ("a", [{"name": "/robot_description", "value": "<robot/>"}])
    seen = len(one.data)
    late.subscribe("/scan", 1)
    wait_for(lambda: topics.hear(*SCAN, b"unseen", False) or (1, b"unseen") in late.data, "a scan")
    assert len(one.data) == seen


def test_a_viewer_cannot_publish_and_nonsense_disturbs_nobody(served, topics):
    viewer = Viewer(served)
    viewer.send("", [], {}, "nonsense", {"op": "advertise", "channels": [{"id": 1, "topic": "cmd_vel"}]},
                {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}, {"op": "subscribe"},
                {"op": "setParameters", "parameters": [{"name": "x", "value": 1}]}, "[" * 500, "\x01\x00")
    wait_for(lambda: topics.wanted(), "the subscriptions")
    topics.hear(*SCAN, b"1", False)
    viewer.subscribe("/scan", 5)
    wait_for(lambda: topics.hear(*SCAN, b"2", False) or (5, b"2") in viewer.data, "a scan")
    assert (served.robot.sent, served.robot.orders) == ([], [])
