"""The far ends of robots: the board's end of the serial port, who sends cmd_vel, who reads odom.

All in one thread with one select() for any number of robots and masters, without rospy: what measures costs a fraction
of what is measured, and none of its threads waits for another.
"""

import contextlib
import heapq
import io
import itertools
import os
import re
import select
import socket
import struct
import threading
import time
import tty
import xmlrpc.client
from xmlrpc.server import SimpleXMLRPCServer

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.figures import percentile
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board
from robotont_testing.streams import Stream

LEVELS = 50      # speeds forward, by which packets and messages are recognised: level * STEP
STEP = 0.02      # [m/s]; more than an edge per period
CALLER = "/bench"
PATIENCE = 90.0  # [s] for nodes to start
TWIST = struct.Struct("<I6d")         # length, then the message
FORWARD = struct.Struct("<d")         # twist.twist.linear.x of an Odometry,
FORWARD_AT = -8 * (36 + 6)            # which so many bytes of covariance and twist end
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")


class SilenceError(Exception):
    """Nodes that do not start, connect or answer."""


class Loop:
    """Calls who has something to read, and tasks when they are due; serves the topics of all robots."""

    def __init__(self):
        self.robots = {}         # by name
        self.lateness = Stream().delays  # [s] of each task
        self._readers = {}
        self._tasks = []         # heap of (due [s], number, period [s], action)
        self._numbers = itertools.count()
        self._topics = socket.create_server(("127.0.0.1", 0))
        self.read(self._topics.fileno(), self._accept)
        server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
        server.register_function(self._request_topic, "requestTopic")
        server.register_function(self._publisher_update, "publisherUpdate")
        self.uri = f"http://127.0.0.1:{server.server_address[1]}/"
        threading.Thread(target=server.serve_forever, daemon=True).start()

    def read(self, descriptor, action):
        """Call `action` whenever the descriptor has something to read."""
        self._readers = {**self._readers, descriptor: action}  # a new one, for other threads may look at the old

    def forget(self, descriptor):
        """The descriptor is about to be closed."""
        self._readers = {other: action for other, action in self._readers.items() if other != descriptor}

    def every(self, period, action, phase=0.0):
        """Call `action` each period [s] from `phase` [s] after now on."""
        heapq.heappush(self._tasks, (time.monotonic() + phase, next(self._numbers), period, action))

    def idle(self):
        """End all tasks."""
        self._tasks.clear()

    def run(self, seconds=PATIENCE, until=None):
        """Run for so long, or until a condition; return whether that was met (True without one)."""
        end = time.monotonic() + seconds
        tasks = self._tasks
        while not (until and until()):
            now = time.monotonic()
            while tasks and tasks[0][0] <= now:
                due, number, period, action = tasks[0]
                # what is late catches up, but never in bunches: no robot or joystick sends so
                heapq.heapreplace(tasks, (max(due + period, now + period / 2), number, period, action))
                self.lateness.append(now - due)
                action()
                now = time.monotonic()
            if now >= end:
                return not until
            rest = min(tasks[0][0] if tasks else end, end, now + 0.05)
            for descriptor in select.select(list(self._readers), [], [], max(0.0, rest - now))[0]:
                action = self._readers.get(descriptor)
                if action:
                    action()
        return True

    def _accept(self):
        """A subscriber of some robot's cmd_vel."""
        connection, _ = self._topics.accept()
        header = shake_hands(connection, None)
        robot = self.robots[header["topic"].strip("/").partition("/")[0]]
        write_ros_handshake_header(connection, {
            "type": Twist._type, "md5sum": Twist._md5sum, "latching": "0", "callerid": CALLER,
            "message_definition": Twist._full_text})
        robot.listener = connection

    def _request_topic(self, _caller, _topic, _protocols):
        return 1, "", ["TCPROS", "127.0.0.1", self._topics.getsockname()[1]]

    def _publisher_update(self, _caller, topic, publishers):
        self.robots[topic.strip("/").partition("/")[0]].read_from(publishers)
        return 1, "", 0


class Robot:
    """One robot's far ends, in the namespace `name`: its port (a path), cmd_vel and odom."""

    def __init__(self, loop, name, uri, folder):
        self.name, self.uri, self.port = name, uri, str(folder / name)
        self.loop = loop
        self.listener = None   # socket of the subscriber of cmd_vel
        self.odom_at = None    # [s] when the first odometry came
        units = Kinematics(read_wheels(SHIPPED)).units_of_twist((STEP, 0.0, 0.0))
        self._counts = [[round(unit * level) for unit in units] for level in range(LEVELS + 1)]
        self._board = Board("unused")
        self._level = self._number = 0
        self._numbers = None   # of the newest line on the wire
        self._forward = 0.0    # [m/s] of the newest odometry
        self._unit = None      # numbers of a line with a command of level 1
        self._odom_unit = None
        self._sources = set()
        self._rest = b""
        self._odom_rest = b""
        self.begin()
        loop.robots[name] = self
        self._wire, slave = os.openpty()
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), self.port)
        self._slave = slave  # open, or the line would hang up with its first reader
        os.set_blocking(self._wire, False)
        loop.read(self._wire, self._on_wire)

    def register(self):
        """Publish and subscribe."""
        master = xmlrpc.client.ServerProxy(self.uri)
        master.registerPublisher(CALLER, f"/{self.name}/cmd_vel", Twist._type, self.loop.uri)
        _, _, publishers = master.registerSubscriber(CALLER, f"/{self.name}/odom", Odometry._type, self.loop.uri)
        self.read_from(publishers)

    def begin(self):
        """Count from here on."""
        self.commands, self.feedback = Stream(), Stream()

    def command(self, level=None):
        """Publish a cmd_vel of that level, or of the next in the cycle."""
        if level is None:
            self._level = level = self._level % LEVELS + 1
        self.commands.send(time.monotonic(), level)
        self.listener.sendall(TWIST.pack(48, level * STEP, 0.0, 0.0, 0.0, 0.0, 0.0))

    def report(self, level=None):
        """Send a packet of the board: wheels that turn as at that level, or at the next in the cycle."""
        if level is None:
            self._number = level = self._number % LEVELS + 1
        packet = self._board.packet(self._board.motors.follow(self._counts[level]))
        self._board.counter = (self._board.counter + 1) % 256
        self.feedback.send(time.monotonic(), level)
        with contextlib.suppress(BlockingIOError):  # nobody reads: lost
            os.write(self._wire, packet)

    def start(self, rate):
        """Commands and packets at this rate [Hz] from now on, half a period apart."""
        self.loop.every(1 / rate, self.report)
        self.loop.every(1 / rate, self.command, 0.5 / rate)

    def connect(self):
        """Wait until both ways work, and learn what commands look like on the wire, and packets in odom.

        Raises SilenceError.
        """
        if not self._sources:
            self.register()
        self.loop.every(0.02, lambda: self.report(LEVELS))
        if not self.loop.run(until=lambda: self.listener and self._sources):
            raise SilenceError(f"{self.name} has no {'odom' if self.listener else 'subscriber of cmd_vel'}")
        self.loop.every(0.02, lambda: self.command(LEVELS))
        self.loop.run(1.0)
        if not self.loop.run(until=lambda: any(self._numbers or ()) and self._forward):
            raise SilenceError(f"{self.name} passes no {'feedback' if any(self._numbers or ()) else 'commands'} on")
        self._unit = [value / LEVELS for value in self._numbers]
        self._odom_unit = self._forward / LEVELS
        self.loop.idle()

    def close(self):
        """Give all up."""
        self.loop.robots.pop(self.name, None)
        for descriptor in (self._wire, *(source.fileno() for source in self._sources)):
            self.loop.forget(descriptor)
        for thing in (self.listener, *self._sources):
            if thing:
                thing.close()
        os.close(self._wire)
        os.close(self._slave)

    def read_from(self, publishers):
        """Subscribe to the publishers (URIs) of odom."""
        for uri in publishers:
            code, words, protocol = xmlrpc.client.ServerProxy(uri).requestTopic(
                CALLER, f"/{self.name}/odom", [["TCPROS"]])
            if code != 1:
                raise SilenceError(f"{uri} refuses odom: {words}")
            connection = socket.create_connection(tuple(protocol[1:]))
            shake_hands(connection, {
                "topic": f"/{self.name}/odom", "type": Odometry._type, "md5sum": Odometry._md5sum,
                "callerid": CALLER, "tcp_nodelay": "1", "message_definition": Odometry._full_text})
            self._sources.add(connection)
            self.loop.read(connection.fileno(), lambda connection=connection: self._on_odom(connection))

    def _on_wire(self):
        data, now = os.read(self._wire, 65536), time.monotonic()
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            numbers = [float(number) for number in NUMBER.findall(line.partition(b";")[0])]
            if self._unit is None:
                self._numbers = numbers or self._numbers
                continue
            level = round(sum(map(float.__mul__, numbers, self._unit)) / sum(unit * unit for unit in self._unit))
            if level:  # zero: repeated by the driver at the end
                self.commands.arrived(now, level)

    def _on_odom(self, connection):
        data, now = connection.recv(65536), time.monotonic()
        self.odom_at = self.odom_at or now
        if not data:
            self.loop.forget(connection.fileno())
            self._sources.discard(connection)
            connection.close()
            return
        data = self._odom_rest + data
        start = 0
        while len(data) - start >= 4:
            end = start + 4 + int.from_bytes(data[start:start + 4], "little")
            if len(data) < end:
                break
            forward, = FORWARD.unpack_from(data, end + FORWARD_AT)
            start = end
            if self._odom_unit is None:
                self._forward = forward
            elif round(forward / self._odom_unit):  # zero: packets that a node makes up
                self.feedback.arrived(now, round(forward / self._odom_unit))
        self._odom_rest = data[start:]


def shake_hands(connection, header):
    """Send a TCPROS header, if any; return the other side's. The connection sends small messages at once."""
    connection.settimeout(5.0)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if header:
        write_ros_handshake_header(connection, header)
    return read_ros_handshake_header(connection, io.BytesIO(), 65536)


def late(loop):
    """[ms] by which 99 % of what the rig itself does is late at most: how quiet the machine is."""
    return 1000 * percentile(loop.lateness, 0.99) if loop.lateness else 0.0
