"""Nodes without ROS, in a test's own time: what they send is kept, what they hear is handed to them."""

import contextlib
import math
import pydoc
import threading
from collections import defaultdict
from types import SimpleNamespace
from unittest.mock import patch

import rosgraph
import rospy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

DROPPING = "robotont_driver.rospy_repairs.dropping_publisher.DroppingPublisher.__init__"
WAITING = ("time.sleep", "builtins.open", "rosgraph.Master", "rospy.get_param", "rospy.set_param", "rospy.ServiceProxy",
           "rospy.wait_for_service", "xmlrpc.client.ServerProxy", "subprocess.Popen", "threading.Thread.join")


@contextlib.contextmanager
def waiting_for_nobody():
    """A block that fails where it waits: for the master, another node, the disk or time. Other threads may."""
    own = threading.get_ident()

    def refused_here(function):
        def wait(*given, **named):
            assert threading.get_ident() != own, "a callback of a command or a stop waits"
            return function(*given, **named)
        return wait
    with contextlib.ExitStack() as patches:
        for name in WAITING:
            patches.enter_context(patch(name, refused_here(pydoc.locate(name))))
        yield


class Bus:
    """Stands in for rospy's topics, services and clock in the modules of a node, and for the node's own threads."""

    def __init__(self, monkeypatch, *modules):
        self.now = 100.0               # [s]
        self.sent = defaultdict(list)  # messages by topic
        self.latched = set()           # topics whose newest message those hear who come late
        self.heard_by = defaultdict(list)       # callbacks by topic
        self.options = {}              # of subscribers, by topic
        self.connections = defaultdict(int)     # from and to others, by topic
        self.parameters = {}           # of the server, by name as they are asked for
        self.services, self.reports = {}, {}    # callbacks by name; of the diagnostics by subject
        self.work = []                 # what the node's threads do
        self.publishers = {}           # as the master tells: names of nodes by topic
        self.published = []            # times of diagnostics before theirs
        self._headers = {}             # one for each connection
        for name, stand_in in (("Publisher", self._publisher), ("Subscriber", self._subscriber),
                               ("Service", lambda name, _, callback: self.services.update({name: callback})),
                               ("on_shutdown", lambda _: None), ("get_name", lambda: "/node"),
                               ("resolve_name", "/{}".format),
                               ("get_param", lambda name, default=None: self.parameters.get(name, default))):
            monkeypatch.setattr(rospy, name, stand_in)
        monkeypatch.setattr(rosgraph, "Master", lambda _: SimpleNamespace(
            getSystemState=lambda: (list(self.publishers.items()), [], [])))
        monkeypatch.setattr(rospy.Time, "now", lambda: rospy.Time.from_sec(self.now))
        monkeypatch.setattr(DROPPING, lambda publisher, *given: vars(publisher).update(vars(self._publisher(*given))))
        for module in modules:
            for name, stand_in in (("boot_time", lambda: self.now), ("RepeatingThread", self.work.append),
                                   ("Health", self._health), ("is_local", lambda *_: True),
                                   ("Reconnector", lambda *_: SimpleNamespace(look=lambda: None))):
                monkeypatch.setattr(module, name, stand_in, raising=False)

    def hear(self, topic, message, sender="/somebody"):
        """A message comes, by the connection of a sender; "": of one that has not said its name."""
        message._connection_header = self._headers.setdefault((topic, sender), {"callerid": sender} if sender else {})
        with waiting_for_nobody():
            for callback in self.heard_by[topic]:
                callback(message)

    def publish(self, topic, message):
        """Called for what is published."""
        self.sent[topic].append(message)

    def _publisher(self, topic, kind, latch=False, **_):
        def publish(given):
            self.publish(topic, given if isinstance(given, kind) else kind(given))
        self.latched |= {topic} if latch else set()
        return SimpleNamespace(publish=publish, get_num_connections=lambda: self.connections[topic])

    def _subscriber(self, topic, _kind, callback, *given, **options):
        heard, self.options[topic] = (lambda message: callback(message, *given)), options
        self.heard_by[topic].append(heard)
        return SimpleNamespace(get_num_connections=lambda: self.connections[topic],
                               unregister=lambda: self.heard_by[topic].remove(heard))

    def _health(self, _robot, subjects):
        self.reports.update(subjects)
        return SimpleNamespace(publish_now=lambda: self.published.append(self.now))



def transform(parent, child, x=0.0, y=0.0, yaw=0.0):
    """A TransformStamped on the floor [m, rad]."""
    turn = Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return TransformStamped(Header(frame_id=parent), child, Transform(Vector3(x, y, 0.0), turn))
