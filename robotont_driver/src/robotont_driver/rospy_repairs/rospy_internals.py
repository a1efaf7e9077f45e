"""Private parts of rospy and actionlib that this stack uses, each with its reason; elsewhere ruff refuses them."""
# test_rospy_internals.py fails when one of them changes

import contextlib
import functools
import io
import operator
import socket
import threading

import rospy
from rospy.impl import transport
from rospy.impl.registration import RegManager, get_registration_listeners, get_topic_manager
from rospy.impl.tcpros_base import TCPROSServer

MOST_SILENT = 50  # who have connected and said nothing; one more, and the first of them has to go


# connection_header(message): what the publisher of a received message has said of itself, a dict with `callerid`,
# `latching`, `md5sum`, ... It is the same object for all messages of a connection. rospy names the sender nowhere else.
connection_header = operator.attrgetter("_connection_header")


def serialized(message):
    """The bytes of a message, of an AnyMsg as they came; it is typed where another subscriber of its topic is."""
    if isinstance(message, rospy.AnyMsg):
        return message._buff
    output = io.BytesIO()
    message.serialize(output)
    return output.getvalue()


def connections(topic):
    """The connections of a Publisher or Subscriber, a new list for each change: to look at their sockets."""
    return topic.impl.connections


def connection_numbers(topic, header):
    """(number of a topic's connection with this header, None: it has ended; that of the newest here): they rise."""
    subscriber = get_topic_manager().get_subscriber_impl(topic)
    number = next((one.id for one in subscriber.connections if one.header is header), None) if subscriber else None
    return number, transport._transport_id


def disconnect(subscriber, connection):
    """End a connection to a publisher, with all that waits in it."""
    connection.close()
    subscriber.impl.remove_connection(connection)


def connect_anew(subscriber, uri):
    """Connect to the publisher at `uri` once more, as if the master had just named it."""
    # not by `publisherUpdate`: of several such words on a topic rospy takes the newest only, the master's would be lost
    for manager in get_registration_listeners().listeners:
        if isinstance(manager, RegManager):
            _aside(manager._connect_topic_thread, subscriber.resolved_name, uri)


def _aside(task, *arguments):
    threading.Thread(target=task, args=arguments, daemon=True).start()


def goal_id(handle):
    """Id of the goal of an actionlib.ClientGoalHandle: to know it among those of others."""
    return handle.comm_state_machine.action_goal.goal_id.id


def mend():
    """Mend how this process connects, and its end; call before rospy.init_node."""
    # Debian 11's rospy 1.15.9 asks its threads by this name as it ends, Python 3.9 has it no more: traceback, status 1
    threading.Thread.isAlive = threading.Thread.is_alive
    _hear_all_who_connect()
    _connect_once_at_a_time()


@functools.lru_cache(maxsize=None)
def _hear_all_who_connect():
    """Read in a thread of its own what each says who connects for a topic."""
    # rospy reads it, without a time limit, in the thread that accepts them: whoever says nothing shuts out all others.
    # So does a question by XML-RPC to a killed node that had this port, as subscribers ask at each change of
    # publishers: its first four bytes, "POST", are a length of 1.4 GB.
    hear, silent = TCPROSServer._tcp_server_callback, {}

    def hear_one(server, connection, address):
        try:
            hear(server, connection, address)
        finally:
            silent.pop(connection, None)

    def hear_aside(server, connection, address):
        silent[connection] = None
        if len(silent) > MOST_SILENT:
            first = next(iter(silent))
            silent.pop(first, None)
            with contextlib.suppress(OSError):
                first.shutdown(socket.SHUT_RDWR)  # its thread ends
        _aside(hear_one, server, connection, address)
    TCPROSServer._tcp_server_callback = hear_aside


@functools.lru_cache(maxsize=None)
def _connect_once_at_a_time():
    """When the master names a publisher twice within a moment, rospy connects twice, and may end both connections."""
    connect, lock, asking = RegManager._connect_topic_thread, threading.Lock(), set()  # (topic, URI)

    def connect_once(manager, topic, uri):
        with lock:
            if (topic, uri) in asking:
                return
            asking.add((topic, uri))
        try:
            connect(manager, topic, uri)
        finally:
            asking.discard((topic, uri))
    RegManager._connect_topic_thread = connect_once
