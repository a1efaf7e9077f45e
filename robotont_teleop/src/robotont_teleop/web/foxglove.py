"""Viewers without ROS, such as Lichtblick or Foxglove, see the robot: their WebSocket protocol, read only.

https://github.com/foxglove/ws-protocol, subprotocol foxglove.websocket.v1, messages in ROS 1's encoding.
"""

import asyncio
import contextlib
import itertools
import json
import struct
import time
from urllib.parse import urlsplit

import tornado.web
import tornado.websocket

from robotont_teleop.web.access import LOCAL_NAMES
from robotont_teleop.web.web_handlers import Guarded
from robotont_teleop.web.websocket_frames import reads, write

SUBPROTOCOL = "foxglove.websocket.v1"
MAX_VIEWERS = 4
LONGEST = 1024  # [bytes] of a request
MESSAGE = struct.Struct("<BIQ")  # opcode, subscription, time [ns]
MESSAGE_DATA = 1


class Channels:
    """What viewers can see: one channel per topic, known from its first message on. All in the server's loop.

    topics: ViewerTopics; its messages come while there are `viewers`.
    """

    def __init__(self, topics, loop):
        self._loop = loop
        self._numbers = itertools.count(1)
        self.viewers = set()
        self.known = {}   # topic: its channel, as it is advertised
        self.latched = {}  # number of a channel: its newest message, for those who subscribe later
        self.topics = topics(lambda: bool(self.viewers), self._hear)

    def _hear(self, *message):
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._take, *message)

    def _take(self, topic, kind, definition, data, latched):
        channel = self.known.get(topic)
        if channel is None or (channel["schemaName"], channel["schema"]) != (kind, definition):
            channel = {"id": next(self._numbers), "topic": topic, "encoding": "ros1", "schemaName": kind,
                       "schema": definition}
            self.known[topic] = channel
            for viewer in self.viewers:
                viewer.tell({"op": "advertise", "channels": [channel]})
        if latched:
            self.latched[channel["id"]] = data
        for viewer in self.viewers:
            viewer.show(channel["id"], data, latched)


class FoxgloveSocket(Guarded, tornado.websocket.WebSocketHandler):
    """The connection of one viewer: it may look, and nothing else."""

    max_message_size = LONGEST

    def initialize(self):
        """Called by tornado."""
        self._subscriptions = {}  # number of a channel: of the viewer's subscription

    @property
    def authorised(self):
        """Whether it brings the cookie of the page, or the token behind `?token=`: a viewer has no login page."""
        token = self.get_query_argument("token", "")
        if super().authorised or not token:  # without one it has not tried a wrong one
            return super().authorised
        return self.server.access.log_in(token, self.request.remote_ip, time.monotonic()) == "in"

    def check_origin(self, origin):
        """Called by tornado. With the token any viewer; else one that this computer has served."""
        given = bool(self.get_query_argument("token", "")) and self.server.access.needs_token
        return given or urlsplit(origin).hostname in LOCAL_NAMES

    def prepare(self):
        """Called by tornado before the connection is upgraded."""
        super().prepare()
        if len(self.server.channels.viewers) >= MAX_VIEWERS:
            raise tornado.web.HTTPError(503, reason="too many viewers")

    def select_subprotocol(self, subprotocols):
        """Called by tornado."""
        return SUBPROTOCOL if SUBPROTOCOL in subprotocols else None

    def open(self):
        """Called by tornado."""
        if self.selected_subprotocol != SUBPROTOCOL:
            self.close(1002, f"allowed: {SUBPROTOCOL}")
            return
        self.set_nodelay(True)
        self.tell({"op": "serverInfo", "name": self.server.robot.name, "capabilities": ["parameters"],
                   "supportedEncodings": ["ros1"], "metadata": {"ROS_DISTRO": "noetic"}})
        self.tell({"op": "advertise", "channels": list(self.server.channels.known.values())})
        self.server.channels.viewers.add(self)

    async def on_message(self, text):
        """Called by tornado: what is no request of the protocol is not answered."""
        try:
            request = json.loads(text)
            if request["op"] == "subscribe":
                for one in request["subscriptions"]:
                    self._subscribe(int(one["channelId"]), int(one["id"]))
            elif request["op"] == "unsubscribe":
                gone = {int(number) for number in request["subscriptionIds"]}
                self._subscriptions = {channel: number for channel, number in self._subscriptions.items()
                                       if number not in gone}
            elif request["op"] == "getParameters":
                asked = self.server.channels.topics.description  # of the master
                value = await asyncio.get_running_loop().run_in_executor(None, asked)
                self.tell({"op": "parameterValues", "id": request.get("id"),
                           "parameters": [{"name": "/robot_description", "value": value}] if value else []})
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            self.server.refused += 1

    def on_close(self):
        """Called by tornado."""
        self.server.channels.viewers.discard(self)

    def _subscribe(self, channel, number):
        known = {one["id"] for one in self.server.channels.known.values()}
        if channel in known and 0 <= number < 2 ** 32:
            self._subscriptions[channel] = number
            if channel in self.server.channels.latched:
                self.show(channel, self.server.channels.latched[channel], True)

    def show(self, channel, data, latched):
        """A message; a viewer that does not read loses those that are not latched."""
        number = self._subscriptions.get(channel)
        if number is not None and (latched or reads(self)):
            write(self, MESSAGE.pack(MESSAGE_DATA, number, time.time_ns()) + data, binary=True)

    def tell(self, message):
        """An object of the protocol."""
        write(self, json.dumps(message))
