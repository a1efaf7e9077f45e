"""A publisher that sends from the calling thread and holds it up for nobody."""

import select
import warnings

import rospy

from robotont_driver.rospy_repairs.rospy_internals import connections, publish_to


class DroppingPublisher:
    """When `publish` returns, the message is in the sockets, also the last one of a node that shuts down, the stop.

    A subscriber that stops reading, whose socket has less than a third of its room left, loses messages. For messages
    of up to a few kB; a socket has room for seconds of packets.
    """

    def __init__(self, topic, message_type):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)  # that there is no queue
            self._publisher = rospy.Publisher(topic, message_type, tcp_nodelay=True)
        self._polled = None  # list of the connections whose sockets `_room` looks at
        self._room = None

    def get_num_connections(self):
        """Number of subscribers, as of a rospy.Publisher."""
        return self._publisher.get_num_connections()

    def publish(self, message):
        """Publish a message to those who have room for it."""
        subscribers = connections(self._publisher)
        if not subscribers:
            return
        if subscribers is not self._polled:  # rospy makes a new list for each change
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
        self._room = select.poll()
        for connection in subscribers:
            descriptor = connection.fileno()
            if descriptor is not None and descriptor >= 0:
                self._room.register(descriptor, select.POLLOUT)
        self._polled = subscribers
