"""Watches the network to the publishers on other machines, and connects to them anew when it comes back.

After an outage of T seconds TCP sends again only up to T seconds later, for it doubles its pause with every failed
attempt. A new connection needs a fraction of a second, and brings nothing old.
"""

import contextlib
import socket
import threading
from urllib.parse import urlsplit

import rospy

from robotont_driver.command.command_age import Link
from robotont_driver.ros.clocks import boot_time
from robotont_driver.ros.worker import Worker
from robotont_driver.rospy_repairs.rospy_internals import ANSWER_WITHIN, connect_anew, connections, disconnect

PERIOD = 0.25        # [s] between two looks
TAKEN_WITHIN = 2.0   # [s] rospy connects to those that it was asked for, where nothing is in the way


class OutageWatch:
    """Looks at the machines of silent publishers, and connects subscribers again to those that were out of reach.

    `newest`: subscribers of commands; data that waits in their old connections is too old and dropped. `every`:
    subscribers that may lose no message, such as an emergency stop's; their old connections still deliver, late.
    """

    def __init__(self, newest=(), every=()):
        self._newest = newest
        self._every = every
        self._links = {}     # Link of each connection
        self._received = {}  # bytes received from each connection
        self._probed = set()  # URIs that are being probed
        self._seen = set()    # (topic, URI) of each connection, those included that rospy is about to make
        self._asked = {}      # [s] when rospy was asked to connect, by (topic, URI)
        self._looked = boot_time()
        Worker(self._look)

    def link(self, header):
        """The Link of the connection with this header, of a subscriber in `newest`; None: there is none any more."""
        for topic in self._newest:
            for connection in connections(topic):
                if connection.header is header:
                    return self._links.get(connection) or self._link(connection)
        return None

    def _link(self, connection):
        link = self._links.setdefault(connection, Link(self._looked))  # a new one was not there at the last look
        link.local = link.local or _is_local(connection)
        return link

    def _look(self):
        """Probe the machines of silent and of lost connections; returns the time to rest."""
        now = boot_time()
        silent, there = {}, set()
        for topic in (*self._newest, *self._every):
            for connection in connections(topic):
                if not connection.endpoint_id.startswith("http"):
                    continue  # an old one, kept for the messages that it may still deliver
                there.add((topic, connection.endpoint_id))
                link = self._link(connection)
                active = connection.stat_bytes != self._received.get(connection)
                self._received[connection] = connection.stat_bytes
                if not link.local and (link.lost or not active):
                    silent.setdefault(connection.endpoint_id, []).append((topic, connection, link))
        self._looked = now
        self._follow(there, now)
        for known in (self._links, self._received):
            for connection in [one for one in list(known) if one.done]:
                del known[connection]
        for uri, ways in silent.items():
            if uri not in self._probed:
                self._probed.add(uri)
                threading.Thread(target=self._probe, args=(uri, ways, now), daemon=True).start()
        return PERIOD

    def _follow(self, there, now):
        """Connect anew, once, to those that are connected no more; whoever has ended refuses.

        The handshake of an earlier connection, which waited for an outage to end, makes a publisher drop a newer one.
        """
        gone = self._seen - there
        for pair in list(self._asked):  # other threads add to it
            if now - self._asked[pair] >= TAKEN_WITHIN:
                del self._asked[pair]
        coming = gone & set(self._asked)
        self._seen = there | coming
        for topic, uri in gone - coming:
            self._connect(topic, uri)

    def _probe(self, uri, ways, now):
        """Look at a machine; ways: (topic, connection, link) of each connection to the publisher at `uri`."""
        try:
            address = _ends(ways[0][1])[1] or urlsplit(uri).hostname
            socket.create_connection((address, urlsplit(uri).port), ANSWER_WITHIN).close()
        except OSError as error:  # refused: the publisher has ended, but what it has sent may still come
            if not isinstance(error, ConnectionRefusedError) and not any(link.lost for _, _, link in ways):
                rospy.logwarn("the machine of %s is out of reach", uri)
            for _, _, link in ways:
                link.lost = True
        else:
            for topic, _, link in ways:
                if topic in self._newest:
                    link.reached(now)
            if any(link.lost for _, _, link in ways):
                rospy.loginfo("the machine of %s is back: new connection", uri)
                self._reconnect(uri, [(topic, connection) for topic, connection, link in ways if link.lost])
        finally:
            self._probed.discard(uri)

    def _reconnect(self, uri, lost):
        for topic, connection in sorted(lost, key=lambda pair: pair[0] in self._newest):
            if topic in self._newest:
                disconnect(topic, connection)
            else:
                connection.endpoint_id = f"before the outage at {boot_time():.3f}: {uri}"
            self._connect(topic, uri)

    def _connect(self, topic, uri):
        self._asked[topic, uri] = boot_time()
        connect_anew(topic, uri)


def _ends(connection):
    """(address of this end, of the other) of a connection; (None, None) while there is none."""
    with contextlib.suppress(AttributeError, OSError):
        return connection.socket.getsockname()[0], connection.socket.getpeername()[0]
    return None, None


def _is_local(connection):
    here, there = _ends(connection)
    return here is not None and (here == there or there.startswith("127."))
