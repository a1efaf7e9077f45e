"""Publishers that send from the calling thread."""

import contextlib
import select
import socket
import struct
import warnings

import rospy

SEND_TIMEOUT = struct.pack("@ll", 0, 50000)  # a struct timeval: [s], [us]


class ImmediatePublisher(rospy.SubscribeListener):
    """Publishes from the calling thread, so that no message waits for a thread switch (0.1 ms).

    When `publish` returns, the message is in the socket. So the last packet of a node that shuts down, the stop, is
    out before the process ends. A subscriber that stops reading is disconnected once its socket has been full for
    SEND_TIMEOUT: for packets, of which none may be lost unnoticed.
    """

    def __init__(self, topic, message_type):
        super().__init__()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)  # that there is no queue
            self._publisher = rospy.Publisher(topic, message_type, tcp_nodelay=True)
        self._topic = self._publisher.impl
        self._topic.add_subscriber_listener(self)  # last: subscribers connect before the constructor returns
        self.peer_subscribe()

    def publish(self, message):
        """Publish a message, or the contents of its only field."""
        self._publisher.publish(message)

    def get_num_connections(self):
        """Number of subscribers, as of a rospy.Publisher."""
        return self._publisher.get_num_connections()

    def peer_subscribe(self, *_):
        """Called by rospy after a subscriber has connected; whatever it raised would disconnect that one for good."""
        for connection in self._topic.connections:
            with contextlib.suppress(AttributeError, OSError):  # who is in this process, or has left, has no socket
                connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, SEND_TIMEOUT)


class DroppingPublisher(ImmediatePublisher):
    """Publishes from the calling thread, too, but holds up nobody: a subscriber whose socket is full loses messages.

    For messages of up to a few kB, of which the newest counts: a socket is full when less than a third is free. So
    the odometry goes out, and commands, of which the last one, the stop, must be out before the process ends.
    """

    def __init__(self, topic, message_type):
        super().__init__(topic, message_type)
        self._polled = None  # list of the connections whose sockets `_room` looks at
        self._room = None

    def publish(self, message):
        """Publish a message to those who have room for it."""
        connections = self._topic.connections
        if not connections:
            return
        if connections is not self._polled:
            self._watch(connections)
        ready = self._room.poll(0)
        if len(ready) == len(connections):
            self._send(message)
            return
        with_room = {descriptor for descriptor, _ in ready}
        for connection in connections:
            if connection.fileno() in with_room:
                self._send(message, connection)

    def _send(self, message, connection=None):
        self._topic.acquire()
        try:
            self._topic.publish(message, connection)
        finally:
            self._topic.release()

    def _watch(self, connections):
        """Look at the sockets of these from now on; rospy makes a new list for each change."""
        self._room = select.poll()
        for connection in connections:
            descriptor = connection.fileno()
            if descriptor is not None and descriptor >= 0:
                self._room.register(descriptor, select.POLLOUT)
        self._polled = connections
