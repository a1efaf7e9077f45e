"""Pages in a real browser, with the whole stack on the simulator behind them."""

import math
import time
import unittest

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from robotont_testing import places
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import Processes, free_port, wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.stalling_proxy import StallingProxy

OPEN = "document.getElementById('app')?.dataset.state === 'open'"
LOG = """window.sent = [];   // [when it was sent, message, x of the newest movement then]
window.moves = [];  // [x, when it moved, when that was handled] of each movement of a pointer
const now = () => performance.timeOrigin + performance.now();
let newest = null;
for (const kind of ['pointerrawupdate', 'pointermove']) {
  window.addEventListener(kind, (event) => {
    newest = event.clientX;
    window.moves.push([newest, performance.timeOrigin + event.timeStamp, now()]);
  }, true);
}
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) {
  window.sent.push([now(), text, newest]);
  send.call(this, text);
};"""


@unittest.skipIf(CHROMIUM is None, "no chromium")
class PagesTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.truth, cls.hand, cls.commands = [], [], []
        rospy.Subscriber("ground_truth/odom", Odometry, cls._on_truth, tcp_nodelay=True)
        rospy.Subscriber("cmd_vel/hand", Twist, lambda message: cls.hand.append((time.time(), _values(message))),
                         tcp_nodelay=True)
        rospy.Subscriber("cmd_vel", Twist, lambda message: cls.commands.append((time.time(), _values(message))),
                         tcp_nodelay=True)
        cls.robot = Processes()
        cls.log = cls.robot.folder / "web.log"
        cls.robot.launch("simulation.launch", f"port:={cls.robot.folder / 'robotont'}")
        wait_for(lambda: cls.truth, "the simulator", timeout=60)
        cls.release_emergency_stop = staticmethod(rospy.ServiceProxy("emergency_stop/release", Trigger))
        cls.port = free_port()
        rospy.set_param("/web_teleop_node/port", cls.port)
        cls.proxy = StallingProxy(cls.port)
        cls.browser = Browser()
        cls.start_server()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()
        cls.proxy.close()
        cls.robot.close()

    @classmethod
    def _on_truth(cls, message):
        cls.truth.append((time.monotonic(), _values(message.twist.twist)))

    def setUp(self):
        super().setUp()
        self.addCleanup(self.proxy.flow)
        self.addCleanup(self.release_emergency_stop)
        self.pages = []
        self.addCleanup(lambda: [page.close() for page in self.pages])

    @classmethod
    def start_server(cls):
        cls.log.write_text("")
        cls.server = cls.robot.start(places.program("robotont_teleop", "web_teleop_node"), log=cls.log)
        wait_for(lambda: "drive the robot in a browser" in cls.log.read_text(), "the server")

    def open(self, size=PHONE, dark=False, browser=None, **options):
        page = (browser or self.browser).page(
            f"http://127.0.0.1:{self.proxy.port}/", size, dark, script=LOG, **options)
        self.pages.append(page)
        page.wait(OPEN, "the connection")
        return page

    def close(self, page):
        self.pages.remove(page)
        page.close()

    def speed(self):
        """The newest `rim_speed`."""
        return rim_speed(self.truth[-1][1])


def rim_speed(twist):
    """Of the robot [m/s], and how fast its rim turns around."""
    x, y, turn = twist
    return math.hypot(x, y) + 0.15 * abs(turn)


def _values(twist):
    return twist.linear.x, twist.linear.y, twist.angular.z
