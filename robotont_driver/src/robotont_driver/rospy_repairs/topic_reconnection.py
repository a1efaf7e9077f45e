"""Connects to publishers on other machines anew when the network to them comes back."""
# TCP doubles its pause with every failed attempt: after an outage of T seconds it sends only up to T seconds later. The
# old connection still delivers, late, unless MOST_OLD are newer.

import contextlib
import socket
import threading
from urllib.parse import urlsplit

import rospy

from robotont_driver.rospy_repairs.rospy_internals import connect_anew, connections, disconnect

PERIOD = 0.25        # [s] between two looks
ANSWER_WITHIN = 5.0  # [s] or a question is in vain; meanwhile others are asked ...
MOST_ASKED = 8       # ... up to so many of a machine
OUT_OF_REACH = 2.5   # [s] without an answer; a network with a round trip of 2 s is none that is out
OLD = "before an outage: "  # so begins the endpoint_id of a connection that a newer one follows
MOST_OLD = 4         # of these, of a publisher that does not end them


class Reconnector:
    """`look` is called again and again. clock: returns the time [s]; subscribers: whose connections are made anew."""

    def __init__(self, clock, subscribers):
        self._clock, self._subscribers = clock, subscribers
        self._seen = {}      # [s] of the newest question that was answered, by URI of a publisher
        self._lost = set()   # URIs of those out of reach
        self._asking = {}    # threads that wait for an answer, by URI
        self._known = set()  # (subscriber, URI) of the connections at the last look
        self._away = set()   # likewise, to connect anew when their machines are back

    def look(self):
        """Look at the machines, make connections; [s] to rest."""
        now = self._clock()
        ways = {}  # to other machines: (subscriber, connection) by URI
        there = [(topic, connection) for topic in self._subscribers for connection in connections(topic)
                 if not connection.endpoint_id.startswith(OLD)]
        for topic, connection in there:
            if _ends(connection)[0] and not _is_local(connection):
                ways.setdefault(connection.endpoint_id, []).append((topic, connection))
        self._away |= self._known - {(topic, one.endpoint_id) for topic, one in there}  # once: who has ended refuses
        self._known = {(topic, uri) for uri, pairs in ways.items() for topic, _ in pairs}
        uris = {uri for _, uri in self._known | self._away}
        self._seen = {uri: self._seen.get(uri, now) for uri in uris}
        self._lost &= uris
        self._asking = {uri: self._asking.get(uri, []) for uri in uris}
        for uri in uris:
            self._look_at(uri, ways.get(uri, ()), now)
        return PERIOD

    def _look_at(self, uri, there, now):
        self._asking[uri] = asking = [one for one in self._asking[uri] if one.is_alive()]
        if len(asking) < MOST_ASKED:
            asking.append(threading.Thread(target=self._ask, args=(uri, there, now), daemon=True))
            asking[-1].start()
        lost = now - self._seen[uri] > OUT_OF_REACH
        if lost != (uri in self._lost):
            rospy.logwarn("the machine of %s is %s", uri, "out of reach" if lost else "back")
            self._lost ^= {uri}
            self._away |= {(topic, uri) for topic, _ in there if lost}
        if not lost:
            for topic in [topic for topic, one in self._away if one == uri]:
                self._connect(topic, uri)

    def _ask(self, uri, there, now):
        place = urlsplit(uri)
        address = next(filter(None, (_ends(one)[1] for _, one in there)), place.hostname)
        try:
            socket.create_connection((address, place.port), ANSWER_WITHIN).close()
        except ConnectionRefusedError:
            pass  # its publisher has ended; the machine has not
        except OSError:
            return
        self._seen[uri] = max(self._seen.get(uri, now), now)

    def _connect(self, topic, uri):
        self._away.discard((topic, uri))
        self._known.discard((topic, uri))
        old = [one for one in connections(topic) if one.endpoint_id in (uri, OLD + uri)]
        for connection in old:
            connection.endpoint_id = OLD + uri  # else rospy ends it
        for connection in old[:-MOST_OLD]:
            disconnect(topic, connection)
        connect_anew(topic, uri)


def _ends(connection):
    """(address of this end, of the other) of a connection; (None, None) while there is none."""
    with contextlib.suppress(AttributeError, OSError):
        return connection.socket.getsockname()[0], connection.socket.getpeername()[0]
    return None, None


def _is_local(connection):
    here, there = _ends(connection)
    return here is not None and (here == there or there.startswith("127."))


def is_local(subscribers, header):
    """Whether the connection with this header, of one of the subscribers, comes from this machine."""
    return any(_is_local(one) for topic in subscribers for one in connections(topic) if one.header is header)
