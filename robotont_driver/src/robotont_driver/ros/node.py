"""What the nodes share: start with checked parameters or exit, work at intervals, report health."""

import argparse
import contextlib
import gc
import os
import select
import signal
import socket
import struct
import sys
import threading
import time
from typing import Callable, NamedTuple, Optional, Tuple

import diagnostic_updater
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from robotont_driver.kinematics.wheels import KEYS, read_wheels
from robotont_driver.parameters.parameters import (
    Parameter,
    ParameterError,
    fault,
    help_text,
    is_number,
    read_parameters,
)
from robotont_driver.ros import rospy_end
from robotont_driver.ros.log_queue import queue_log

SEND_TIMEOUT = struct.pack("@ll", 0, 50000)  # a struct timeval: [s], [us]
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


# Parameters that every node has besides its own; diagnostic_updater documents this one.
COMMON_PARAMETERS = (
    Parameter("diagnostic_period", 1.0, "between two diagnostics", "s", minimum=0.1, maximum=60.0),
)


class Part(NamedTuple):
    """A node to start, alone in its process or beside others.

    name: its full name in the graph, under which its parameters stand. start(wheels, parameters) makes it; table:
    its parameters. check(wheels, parameters, other) returns a list of conflicts between parameters; other(name,
    default) is a parameter of another node.
    """

    name: str
    start: Callable
    table: Tuple[Parameter, ...]
    check: Optional[Callable] = None


def answer_help(name, explanation, table=()):
    """With the argument `-h`, print the explanation and the parameters of the table, and exit.

    Any other argument that is no remapping ends the program with 2, and a message.
    """
    argparse.ArgumentParser(
        prog=name, description=explanation, epilog=help_text((*table, *COMMON_PARAMETERS)) if table else "",
        formatter_class=argparse.RawDescriptionHelpFormatter).parse_args(rospy.myargv()[1:])


def init_node(name, explanation, table=()):
    """Make this process the node `name`, after `answer_help`."""
    answer_help(name, explanation, table)
    rospy_end.init_node(name)
    queue_log()


def run_node(name, node_class, table, check=None):
    """Start a node, node_class(wheels, parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    serve(Part(rospy.get_name(), node_class, table, check))


def run_without_wheels(name, node_class, table):
    """Start a node that needs no wheels, node_class(parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    with signals_wait():
        node_class(own_parameters(table))
    _spin()


def serve(*parts):
    """Start the parts and serve until ROS shuts down; list wrong parameters, if any, of all parts and exit with 1."""
    with signals_wait():
        for start, wheels, parameters in _read_all(parts):
            start(wheels, parameters)
    _spin()


def _read_all(parts):
    """(start, wheels, parameters) of each part; ends the process with all faults, if any."""
    faults = []
    wheels = None
    try:
        wheels = running_wheels(rospy.get_namespace())
    except ParameterError as error:
        faults += error.faults
    starts = []
    for part in parts:
        whose = "" if part.name == rospy.get_name() else part.name + ": "
        try:
            parameters = private_parameters(part.table, part.name)
        except ParameterError as error:
            faults += [whose + message for message in error.faults]
            continue
        if part.check and wheels:
            faults += [whose + message for message in part.check(wheels, parameters, parameter_of_another)]
        starts.append((part.start, wheels, parameters))
    if faults:
        refuse(faults)
    return starts


def running_wheels(namespace):
    """`Wheels` of the robot that runs in a namespace, from its parameters. Raises ParameterError."""
    given = rospy.get_param(namespace, {})
    if not any(key in given for key in KEYS):
        raise ParameterError([f"wheelAmount and its kin: found none in {namespace}, where no robot runs: start "
                              "robot.launch or simulation.launch first, or rosparam load config/wheel_params.yaml"])
    try:
        return read_wheels(given)
    except ParameterError as error:
        raise ParameterError(f"{message} (wheel parameters are read from {namespace})"
                             for message in error.faults) from None


@contextlib.contextmanager
def signals_wait():
    """SIGINT and SIGTERM that come within take effect behind it, or end the process where that takes too long.

    rospy shuts down within the signal's handler, which asks the master. Where the handler interrupts another question
    to the master, as starting nodes ask many, it waits for ever for the lock that the interrupted question holds.
    """
    came = []

    def note(number, _frame):
        came.append(number)
        rospy_end.end_soon()
    handlers = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in came[:1]:
            os.kill(os.getpid(), number)


def _spin():
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while messages wait
    rospy.spin()


def private_parameters(table, node="~"):
    """The parameters of a node of this process by name. Raises ParameterError."""
    given = rospy.get_param(node, {})
    if not isinstance(given, dict):
        raise ParameterError([fault("~", given, "parameters by name, as in `publish_rate: 20.0`: is a line missing?")])
    return read_parameters((*table, *COMMON_PARAMETERS), {**official_parameters(table), **given})


def own_parameters(table):
    """The private parameters of a node that needs no wheels, by name; lists wrong ones, if any, and exits with 1."""
    try:
        return private_parameters(table)
    except ParameterError as error:
        return refuse(error.faults)


def parameter_of_another(name, default):
    """A number on the parameter server, by a name relative to the namespace, such as driver_node/publish_rate.

    The default where there is none, or none that is a number: the other node refuses that.
    """
    value = rospy.get_param(name, default)
    return value if is_number(value) else default


def refuse(faults):
    """End the node because of its parameters, with a line for each fault."""
    for message in faults:
        rospy.logfatal("wrong parameter %s", message)
    sys.exit(1)


def official_parameters(table):
    """Values by our names of parameters that are given under the official driver's names."""
    names = {parameter.name: parameter.official for parameter in table if parameter.official}
    return {name: rospy.get_param(official) for name, official in names.items() if rospy.has_param(official)}


class ImmediatePublisher(rospy.SubscribeListener):
    """Publishes from the calling thread, so that no message waits for a thread switch (0.1 ms).

    When `publish` returns, the message is in the socket. So the last packet of a node that shuts down, the stop, is
    out before the process ends. A subscriber that stops reading is disconnected once its socket has been full for
    SEND_TIMEOUT: for packets, of which none may be lost unnoticed.
    """

    def __init__(self, topic, message_type):
        super().__init__()
        self._publisher = rospy.Publisher(topic, message_type, subscriber_listener=self, tcp_nodelay=True, queue_size=1)
        self._topic = self._publisher.impl
        self._topic.set_queue_size(None)

    def publish(self, message):
        """Publish a message, or the contents of its only field."""
        self._publisher.publish(message)

    def get_num_connections(self):
        """Number of subscribers, as of a rospy.Publisher."""
        return self._publisher.get_num_connections()

    def peer_subscribe(self, _topic, _publish, _publish_to_peer):
        """Called by rospy after a subscriber has connected."""
        for connection in self._topic.connections:
            if hasattr(connection, "socket"):  # a subscriber in this very process has none
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


class Worker(threading.Thread):
    """A thread that calls `work` again and again; `work` returns for how long [s] to rest (at most)."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self._work = work
        self.start()

    def run(self):
        """Work until ROS shuts down."""
        while not rospy.is_shutdown():
            time.sleep(self._work())


class Health:
    """Publishes /diagnostics every ~diagnostic_period (1 s), one task per subject (REP 107).

    `subjects` maps a name to a function that returns (level, message, {key: value}). node: its full name, where it is
    not the name of the process.
    """

    def __init__(self, hardware, subjects, node=None):
        node = node or rospy.get_name()
        self._due = threading.Event()
        self._updater = _Updater(node)
        self._period = rospy.get_param(node + "/diagnostic_period", 1.0)
        self._updater.setHardwareID(hardware)
        for name, report in subjects.items():
            self._updater.add(name, _task(report))
        Worker(self._publish)

    def _publish(self):
        if not rospy.is_shutdown():
            self._updater.force_update()
        self._due.wait(self._period)
        self._due.clear()
        return 0.0

    def publish_now(self):
        """Something has happened that should not wait for the next second."""
        self._due.set()


class _Updater(diagnostic_updater.Updater):
    """Publishes under the name of a node, in whatever process it is."""

    def __init__(self, node):
        super().__init__()
        self._prefix = node[1:] + ": "

    def publish(self, statuses):
        """Publish a status, or a list of them."""
        statuses = statuses if isinstance(statuses, list) else [statuses]
        for status in statuses:
            status.name = self._prefix + status.name
        message = DiagnosticArray(status=statuses)
        message.header.stamp = rospy.Time.now()
        self.publisher.publish(message)


def robot_name():
    """The hardware id of a robot's diagnostics: its namespace, or "robotont" without one."""
    return rospy.get_namespace().strip("/") or "robotont"


def _task(report):
    def run(status):
        level, message, values = report()
        status.summary(level, message)
        for key, value in values.items():
            status.add(key, str(value))
        return status
    return run


class Rate:
    """Events per second since the last look, or the one before where that is less than half a second ago."""

    def __init__(self):
        self._count = 0
        self._time = 0.0
        self._rate = 0.0

    def look(self, count, now):
        """[1/s], from the total `count` of events at time `now` [s]."""
        elapsed = now - self._time
        if elapsed >= 0.5:
            self._rate = (count - self._count) / elapsed
            self._count, self._time = count, now
        return self._rate
