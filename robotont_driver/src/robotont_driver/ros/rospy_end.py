"""Lets rospy processes end: soon, whatever hangs, without using a whole core meanwhile; and hear who connects."""

import atexit
import faulthandler
import functools
import os
import threading

import rosgraph.xmlrpc
import rospy
from rospy.impl.tcpros_base import TCPROSServer

FAREWELL = 3.0  # [s] for the last messages and for the master to hear of the end; roslaunch and systemd wait for 10


def init_tool(name):
    """Make this process a node, beside others of that name; signals stay with the process."""
    _end_servers_with_their_sockets()
    _hear_all_who_connect()
    atexit.register(end_soon)  # before rospy's own, which was registered earlier; a tool may work on after a shutdown
    rospy.init_node(name, anonymous=True, disable_signals=True)


def init_node(name):
    """Make this process the node `name`, which ends soon after it was told to."""
    _end_servers_with_their_sockets()
    _hear_all_who_connect()
    rospy.on_shutdown(end_soon)  # the first of all
    rospy.init_node(name)


@functools.lru_cache(maxsize=None)  # the first call counts
def end_soon():
    """End this process after FAREWELL at the latest, with status 1: its way out may lead to a master that hangs.

    rospy unregisters from the master without a time limit. All that stops a robot is sent before.
    """
    faulthandler.dump_traceback_later(FAREWELL, exit=True, file=_NOWHERE)  # a thread that needs nothing of Python


_NOWHERE = open(os.devnull, "w")  # noqa: SIM115  open for as long as the process lives


def _end_servers_with_their_sockets():
    """From now on the XML-RPC server of this process ends when rospy closes its socket; call before init_node.

    rospy only closes the socket, and Python's server then polls it without a pause until the process ends: 0.2 s of
    processor time, taken from all that still runs, and from the end itself.
    """
    rosgraph.xmlrpc.ThreadingXMLRPCServer.service_actions = _end_without_socket


@functools.lru_cache(maxsize=None)
def _hear_all_who_connect():
    """Read in a thread of its own what each says who connects for a topic; call before init_node.

    rospy reads it, without a time limit, in the thread that accepts them: whoever connects and says nothing shuts out
    all others. So does a question by XML-RPC to a killed node that had this port: its first four bytes, "POST", are
    a length of 1.4 GB. The master names killed nodes for ever, and subscribers ask them at each change of publishers.
    """
    hear = TCPROSServer._tcp_server_callback

    def hear_aside(*connection):
        threading.Thread(target=hear, args=connection, daemon=True).start()
    TCPROSServer._tcp_server_callback = hear_aside


def _end_without_socket(server):
    """Called by `serve_forever` in each round; XmlRpcNode expects an OSError as it shuts down."""
    if server.socket.fileno() < 0:
        raise OSError("the socket was closed")
