"""Reconnects to publishers on other machines at once when the network between them comes back.

After an outage of T seconds TCP sends again only up to T seconds later, for it doubles its pause with every failed
attempt: after 30 s without Wi-Fi a robot would stand for up to another 30 s. A new connection needs a fraction of a
second.
"""

import socket
import threading
import time
import xmlrpc.client
from urllib.parse import urlsplit

import rospy

from robotont_driver.node import Worker

PERIOD = 0.25        # [s] between two looks
ANSWER_WITHIN = 0.4  # [s] or a machine counts as out of reach


class OutageWatch:
    """Connects subscribers again to publishers of machines that were out of reach and are back.

    `newest`: subscribers of commands; data that waits in their old connections is too old and dropped. `every`:
    subscribers that may lose no message, such as an emergency stop's; their old connections still deliver, late.
    """

    def __init__(self, newest=(), every=()):
        self._newest = [subscriber.impl for subscriber in newest]
        self._every = [subscriber.impl for subscriber in every]
        self._addresses = {}  # address of each publisher's machine by URI; None: this machine
        self._received = {}   # bytes received from each connection
        self._lost = set()    # URIs of machines out of reach
        Worker(self._look)

    def _look(self):
        """Probe the machines of silent connections; returns the time to rest."""
        silent = set()
        for topic in (*self._newest, *self._every):
            for connection in topic.connections:
                if not connection.endpoint_id.startswith("http"):
                    continue  # an old one, kept for the messages that it may still deliver
                active = connection.stat_bytes != self._received.get(connection)
                self._received[connection] = connection.stat_bytes
                if active:
                    self._lost.discard(connection.endpoint_id)
                else:
                    silent.add(connection.endpoint_id)
        self._received = {connection: amount for connection, amount in self._received.items() if not connection.done}
        probes = [threading.Thread(target=self._probe, args=(uri,), daemon=True) for uri in silent]
        for probe in probes:
            probe.start()
        for probe in probes:
            probe.join()
        return PERIOD

    def _probe(self, uri):
        if uri not in self._addresses:
            self._addresses[uri] = _address_elsewhere(urlsplit(uri).hostname)
        address = self._addresses[uri]
        if address is None:
            return
        try:
            socket.create_connection((address, urlsplit(uri).port), ANSWER_WITHIN).close()
        except ConnectionRefusedError:
            self._lost.discard(uri)  # the machine is there, the publisher has ended
        except OSError:
            if uri not in self._lost:
                rospy.logwarn("the machine of %s is out of reach", uri)
            self._lost.add(uri)
        else:
            if uri in self._lost:
                self._lost.discard(uri)
                rospy.loginfo("the machine of %s is back", uri)
                self._reconnect(uri)

    def _reconnect(self, uri):
        own = xmlrpc.client.ServerProxy(rospy.get_node_uri())
        for topic in (*self._every, *self._newest):
            for connection in [one for one in topic.connections if one.endpoint_id == uri]:
                if topic in self._newest:
                    connection.close()
                    topic.remove_connection(connection)
                else:
                    connection.endpoint_id = f"before the outage at {time.monotonic():.3f}: {uri}"
                uris = [one.endpoint_id for one in topic.connections if one.endpoint_id.startswith("http")]
                own.publisherUpdate("/master", topic.resolved_name, [*uris, uri])  # rospy then connects


def _address_elsewhere(host):
    """IPv4 address of a host that is not this machine; else None."""
    try:
        address = socket.gethostbyname(host)
        with socket.socket() as probe:
            probe.bind((address, 0))
    except socket.gaierror:
        return None
    except OSError:
        return address  # no interface of this machine has this address
    return None
