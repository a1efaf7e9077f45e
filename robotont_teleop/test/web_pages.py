"""Pages of the node in a real browser, alone or on the whole simulated stack."""

import math
import time
import unittest

import rospy
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from std_srvs.srv import Trigger

from robotont_testing import places
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import Processes, free_port, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.stalling_proxy import StallingProxy

OPEN = "$('app')?.dataset.state === 'open'"  # not yet on the login page
LOG = """window.$ = (id) => document.getElementById(id);
window.sent = [];   // [when it was sent, message, x of the newest movement then]
window.newest = null; // x of the newest movement of a pointer
window.sockets = 0;
for (const kind of ['pointerrawupdate', 'pointermove']) {
  window.addEventListener(kind, (event) => (window.newest = event.clientX), true);
}
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    window.sockets += 1;
  }

  send(text) {
    window.sent.push([performance.timeOrigin + performance.now(), text, window.newest]);
    super.send(text);
  }
};"""


def still(frame, child, x=0.0, y=0.0, yaw=0.0):
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = frame, rospy.Time.now()
    transform.transform.translation.x, transform.transform.translation.y = x, y
    transform.transform.rotation.z, transform.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return transform


def room(x=0.0, **info):
    """An empty map whose corner is at x [m]."""
    grid = OccupancyGrid(info=MapMetaData(**{"resolution": 0.5, "width": 12, "height": 12, **info}), data=[0] * 144)
    grid.info.origin.position.x, grid.info.origin.orientation.w = x, 1.0
    return grid


def values_of(twist):
    return twist.linear.x, twist.linear.y, twist.angular.z


@unittest.skipIf(CHROMIUM is None, "no chromium")
class BrowserTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = Browser()
        cls.port = free_port()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()

    def setUp(self):
        super().setUp()
        self.pages = []
        self.addCleanup(lambda: [page.close() for page in self.pages])

    @classmethod
    def start_server(cls, processes, *parameters, **environment):
        cls.log = processes.folder / "web.log"
        cls.log.write_text("")
        server = processes.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={cls.port}",
                                 *parameters, log=cls.log, **environment)
        wait_for(lambda: "drive the robot in a browser" in cls.log.read_text(), "the server")
        return server

    def open(self, url=None, size=PHONE, browser=None, **options):
        page = (browser or self.browser).page(url or f"http://127.0.0.1:{self.port}/", size, script=LOG, **options)
        self.pages.append(page)
        page.wait(OPEN, "the connection")
        return page

    def close(self, page):
        self.pages.remove(page)
        page.close()


class PagesTest(BrowserTest):
    """With the simulator behind them, and a proxy between."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.truth, cls.hand, cls.commands = [], [], []
        rospy.Subscriber("ground_truth/odom", Odometry, lambda message: cls.truth.append(
            (time.monotonic(), values_of(message.twist.twist))), tcp_nodelay=True)
        for topic, heard in (("cmd_vel/hand", cls.hand), ("cmd_vel", cls.commands)):
            rospy.Subscriber(topic, Twist, lambda message, heard=heard: heard.append(
                (time.time(), values_of(message))), tcp_nodelay=True)
        cls.robot = Processes()
        cls.robot.launch("simulation.launch", f"port:={cls.robot.folder / 'robotont'}", "description:=false")
        wait_for(lambda: cls.truth, "the simulator", timeout=60)
        cls.release_emergency_stop = staticmethod(rospy.ServiceProxy("emergency_stop/release", Trigger))
        cls.start_server(cls.robot)
        cls.proxy = StallingProxy(cls.port)
        cls.port = cls.proxy.port

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.proxy.close()
        cls.robot.close()

    def setUp(self):
        super().setUp()
        self.addCleanup(self.proxy.flow)
        self.addCleanup(self.release_emergency_stop)

    def speed(self):
        return rim_speed(self.truth[-1][1])


def rim_speed(twist):
    """Of the robot [m/s], and how fast its rim turns around."""
    x, y, turn = twist
    return math.hypot(x, y) + 0.15 * abs(turn)
