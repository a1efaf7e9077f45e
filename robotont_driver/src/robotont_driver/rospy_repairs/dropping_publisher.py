"""A publisher that sends from the calling thread and holds it up for nobody."""

import select
import warnings

import rospy


class DroppingPublisher:
    """When `publish` returns, the message is in the sockets, also the last one of a node that shuts down, the stop.

    A subscriber that reads no more, whose socket has less than a third of its room left, loses messages (of a few kB).
    """

    def __init__(self, topic, message_type):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)  # that there is no queue
            self._topic = rospy.Publisher(topic, message_type, tcp_nodelay=True).impl
        self.get_num_connections = self._topic.get_num_connections
        self._polled = None  # list of the connections whose sockets `_room` looks at
        self._room = None

    def publish(self, message):
        """Publish a message to those who have room for it."""
        subscribers = self._topic.connections
        if not subscribers:
            return
        if subscribers is not self._polled:  # rospy makes a new list for each change
            self._watch(subscribers)
        ready = self._room.poll(0)
        those = [None]  # all
        if len(ready) < len(subscribers):
            with_room = {descriptor for descriptor, _ in ready}
            those = [one for one in subscribers if one.fileno() in with_room]
        with self._topic.publock:
            for connection in those:
                if not self._topic.closed:  # rospy closes topics at its end, before `is_shutdown` says so
                    self._topic.publish(message, connection)

    def _watch(self, subscribers):
        self._room = select.poll()
        for connection in subscribers:
            descriptor = connection.fileno()
            if descriptor is not None and descriptor >= 0:
                self._room.register(descriptor, select.POLLOUT)
        self._polled = subscribers
