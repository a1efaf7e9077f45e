"""Publishers that send from the calling thread."""

import contextlib
import select
import socket
import struct
import warnings

import rospy

from robotont_driver.rospy_repairs.rospy_internals import add_subscriber_listener, connections, publish_to

SEND_TIMEOUT = struct.pack("@ll", 0, 50000)  # a struct timeval: [s], [us]


class ImmediatePublisher(rospy.SubscribeListener):
    """When `publish` returns, the message is in the socket, also the last one of a node that shuts down, the stop.

    A subscriber that stops reading is disconnected once its socket has been full for SEND_TIMEOUT: for packets, of
    which none may be lost unnoticed.
    """

    def __init__(self, topic, message_type):
        super().__init__()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)  # that there is no queue
            self._publisher = rospy.Publisher(topic, message_type, tcp_nodelay=True)
        add_subscriber_listener(self._publisher, self)  # last: subscribers connect before the constructor returns
        self.peer_subscribe()

    def publish(self, message):
        """Publish a message, or the contents of its only field."""
        try:
            self._publisher.publish(message)
        except rospy.ROSException:
            if not rospy.core.is_shutdown_requested():  # rospy closes topics before `is_shutdown` says so
                raise

    def get_num_connections(self):
        """Number of subscribers, as of a rospy.Publisher."""
        return self._publisher.get_num_connections()

    def peer_subscribe(self, *_):
        """Called by rospy after a subscriber has connected; whatever it raised would disconnect that one for good."""
        for connection in connections(self._publisher):
            with contextlib.suppress(AttributeError, OSError):  # who is in this process, or has left, has no socket
                connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, SEND_TIMEOUT)


class DroppingPublisher(ImmediatePublisher):
    """Holds up nobody: a subscriber whose socket is full, less than a third of it free, loses messages.

    For messages of up to a few kB of which the newest counts.
    """

    def __init__(self, topic, message_type):
        super().__init__(topic, message_type)
        self._polled = None  # list of the connections whose sockets `_room` looks at
        self._room = None

    def publish(self, message):
        """Publish a message to those who have room for it."""
        subscribers = connections(self._publisher)
        if not subscribers:
            return
        if subscribers is not self._polled:
            self._watch(subscribers)
        ready = self._room.poll(0)
        if len(ready) == len(subscribers):
            publish_to(self._publisher, message)
            return
        with_room = {descriptor for descriptor, _ in ready}
        for connection in subscribers:
            if connection.fileno() in with_room:
                publish_to(self._publisher, message, connection)

    def _watch(self, subscribers):
        """Look at the sockets of these from now on; rospy makes a new list for each change."""
        self._room = select.poll()
        for connection in subscribers:
            descriptor = connection.fileno()
            if descriptor is not None and descriptor >= 0:
                self._room.register(descriptor, select.POLLOUT)
        self._polled = subscribers
