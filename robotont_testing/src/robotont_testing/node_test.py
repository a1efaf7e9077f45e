"""Base of the rostests: recorded topics, commands, and the newest diagnostics."""

import itertools
import threading
import unittest
from collections import defaultdict
from typing import ClassVar

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from rospy.impl.registration import RegManager

from robotont_testing.harness import START, Processes, wait_for

OK, WARN, ERROR = 0, 1, 2


def twist(x=0.0, y=0.0, turn=0.0):
    """A Twist on the floor."""
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = x, y, turn
    return message


def _connect_once_at_a_time():
    """As robotont_driver's `rospy_internals` has it, which stands above this package."""
    connect, turns = RegManager._connect_topic_thread, defaultdict(threading.Lock)  # noqa: SLF001

    def connect_in_turn(manager, topic, uri):
        with turns[topic, uri]:
            connect(manager, topic, uri)
    RegManager._connect_topic_thread = connect_in_turn  # noqa: SLF001


class NodeTest(unittest.TestCase):
    """A test beside a running ROS master."""

    @classmethod
    def setUpClass(cls):
        """A node of its own for the test process."""
        _connect_once_at_a_time()
        rospy.init_node("node_test", anonymous=True, disable_signals=True)

    # Topics live as long as the test process: rospy may miss a connection that is ended and made again.
    _publishers: ClassVar[dict] = {}
    _subscribers: ClassVar[dict] = {}

    def setUp(self):
        """Processes that end with the test, and the newest diagnostics in `status`."""
        self.processes = Processes()
        self.addCleanup(self.processes.close)
        for name in rospy.get_param_names():
            if name.endswith("odom_node/run"):  # else the next odom_node would go on from the pose of this one
                rospy.delete_param(name)
        self.status = {}
        self.listen("/diagnostics", DiagnosticArray, self._on_diagnostics)

    def _on_diagnostics(self, message):
        for status in message.status:
            self.status[status.name] = status

    def listen(self, topic, message_type, callback=None, publishers=0):
        """The list into which all messages of the topic go, from as many connected publishers on."""
        messages = []
        if topic not in self._subscribers:
            callbacks = []
            self._subscribers[topic] = callbacks, rospy.Subscriber(
                topic, message_type, lambda message: [call(message) for call in callbacks], tcp_nodelay=True)
        callbacks, subscriber = self._subscribers[topic]
        wait_for(lambda: subscriber.get_num_connections() >= publishers, "publishers of " + topic, START)
        callbacks.append(callback or messages.append)
        self.addCleanup(callbacks.remove, callbacks[-1])
        return messages

    def publisher(self, topic, message_type, subscribers=1):
        """A publisher that is connected to as many subscribers."""
        if topic not in self._publishers:
            self._publishers[topic] = rospy.Publisher(topic, message_type, queue_size=100)
        publisher = self._publishers[topic]
        wait_for(lambda: publisher.get_num_connections() >= subscribers, "subscribers of " + topic, START)
        return publisher

    def let_go_and_drive(self, publisher, moving, x=0.2):
        """Publish zeros and motion [m/s] in turns until moving(): of two words at once a node hears the newer one."""
        speeds = itertools.cycle((0.0, x))
        wait_for(lambda: moving() or publisher.publish(twist(next(speeds))), "a driving robot", period=0.1)

    def wait_for_status(self, name, level, words=""):
        """Wait until the newest diagnostics of a task have a level, and words in the message."""
        def matching():
            status = self.status.get(name)
            return status is not None and status.level == level and words in status.message and status
        try:
            return wait_for(matching, "diagnostics")
        except AssertionError:
            newest = [(status.name, status.level, status.message) for status in self.status.values()]
            raise AssertionError(f"no level {level} with {words!r} of {name!r} in {newest}") from None

    def values(self, name):
        """The values of a task's newest diagnostics, by key, "" for one that it does not have; waits for the first."""
        status = wait_for(lambda: self.status.get(name), f"diagnostics of {name!r}")
        return defaultdict(str, {value.key: value.value for value in status.values})
