"""All that this stack uses of rospy and actionlib beside their public interface, each with its reason.

`test_rospy_internals.py` fails when one of them changes, ruff (SLF001) when another module uses more. What is used of
tornado stands in `robotont_teleop/web/websocket_frames.py`.
"""

import functools
import io
import socket
import threading
import time
from collections import defaultdict
from urllib.parse import urlsplit

import rosgraph.xmlrpc
import rospy
from rospy.impl.registration import RegManager, get_registration_listeners
from rospy.impl.tcpros_base import TCPROSServer

ANSWER_WITHIN = 0.4  # [s] or a machine counts as out of reach


def connection_header(message):
    """What the publisher of a received message has said of itself: a dict with `callerid`, `latching`, `md5sum`, ...

    The same object for all messages of a connection. rospy names the sender of a message nowhere else.
    """
    return message._connection_header


def serialized(message):
    """The bytes of a message; those of an AnyMsg, which has no fields, as they came.

    Where the process has a typed subscriber of the topic as well, rospy hands on typed messages to all.
    """
    if isinstance(message, rospy.AnyMsg):
        return message._buff
    output = io.BytesIO()
    message.serialize(output)
    return output.getvalue()


def connections(topic):
    """The connections of a Publisher or Subscriber, a new list for each change: to look at their sockets.

    rospy tells nobody whether a subscriber reads, or how much has come from a publisher.
    """
    return topic.impl.connections


def add_subscriber_listener(publisher, listener):
    """Tell a rospy.SubscribeListener of all who connect from now on, though others may be connected already."""
    publisher.impl.add_subscriber_listener(listener)


def publish_to(publisher, message, connection=None):
    """Publish to one connection, or to all: one whose socket is full would hold up the others."""
    topic = publisher.impl
    topic.acquire()
    try:
        topic.publish(message, connection)
    finally:
        topic.release()


def disconnect(subscriber, connection):
    """End a connection to a publisher, with all that waits in it."""
    connection.close()
    subscriber.impl.remove_connection(connection)


def connect_anew(subscriber, uri):
    """Connect to the publisher at `uri` once more, as if the master had just named it; nobody else can ask.

    Not by `publisherUpdate`: of several such words on a topic rospy takes the newest only, and the master's would be
    lost, with the new publisher that it names.
    """
    for manager in get_registration_listeners().listeners:
        if isinstance(manager, RegManager):
            _aside(manager._connect_topic_thread, subscriber.resolved_name, uri)


def _aside(task, *arguments):
    threading.Thread(target=task, args=arguments, daemon=True).start()


def goal_id(client):
    """Id of the goal that an actionlib.SimpleActionClient has sent last: to know it among those of others."""
    return client.gh.comm_state_machine.action_goal.goal_id.id


def mend():
    """Mend both servers of this process, and its end; call before rospy.init_node."""
    # Debian 11's rospy 1.15.9 asks its threads by this name as it ends, Python 3.9 has it no more: traceback, status 1
    threading.Thread.isAlive = threading.Thread.is_alive
    rosgraph.xmlrpc.ThreadingXMLRPCServer.service_actions = _end_without_socket
    _hear_all_who_connect()
    _connect_when_within_reach()


def _end_without_socket(server):
    """Called by `serve_forever` in each round; XmlRpcNode expects an OSError as it shuts down.

    rospy only closes the socket, and Python's server then polls it without a pause until the process ends: 0.2 s of
    processor time, taken from all that still runs, and from the end itself.
    """
    if server.socket.fileno() < 0:
        raise OSError("the socket was closed")


@functools.lru_cache(maxsize=None)
def _hear_all_who_connect():
    """Read in a thread of its own what each says who connects for a topic.

    rospy reads it, without a time limit, in the thread that accepts them: whoever connects and says nothing shuts out
    all others. So does a question by XML-RPC to a killed node that had this port: its first four bytes, "POST", are
    a length of 1.4 GB. The master names killed nodes for ever, and subscribers ask them at each change of publishers.
    """
    hear = TCPROSServer._tcp_server_callback

    def hear_aside(*connection):
        _aside(hear, *connection)
    TCPROSServer._tcp_server_callback = hear_aside


@functools.lru_cache(maxsize=None)
def _connect_when_within_reach():
    """Ask a publisher for its connection as soon as its machine is within reach, and only then, once at a time.

    rospy asks at once, waits 60 s for an answer, and up to 32 s before it asks again: a commander that starts just
    before an outage would be heard a minute after it. When the master names a publisher twice within a moment, rospy
    connects twice, and may end both connections: it would never be heard.
    """
    connect, waiting = RegManager._connect_topic_thread, set()  # (topic, URI)
    turns = defaultdict(threading.Lock)  # likewise

    def connect_within_reach(manager, topic, uri):
        if (topic, uri) in waiting:
            return
        waiting.add((topic, uri))
        pause = 0.1
        while not (within_reach(urlsplit(uri)) or rospy.is_shutdown()):
            time.sleep(pause)
            pause = min(2 * pause, 1.0)
        waiting.discard((topic, uri))
        with turns[topic, uri]:  # the second one finds the first one's connection
            connect(manager, topic, uri)
    RegManager._connect_topic_thread = connect_within_reach


def within_reach(place):
    """Whether the machine of an URI, as of `urlsplit`, answers: if only that nobody listens there."""
    try:
        socket.create_connection((place.hostname, place.port), ANSWER_WITHIN).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return True
