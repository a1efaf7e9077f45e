"""The node of the page in a real browser, without a robot: odometry and a map that stand still."""

import math
import unittest

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from web_client import Client

from robotont_driver.ros.worker import Worker
from robotont_testing import places
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import free_port, wait_for
from robotont_testing.node_test import NodeTest

POSE, MAP_TO_ODOM = (0.5, -0.25), (1.0, 2.0)  # [m]
YAW = 0.6             # [rad]
DRIVE, STOP = (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)
OPEN = "document.getElementById('app')?.dataset.state === 'open'"  # not yet on the login page


def still(frame, child, x=0.0, y=0.0):
    """A transform by (x, y) [m]."""
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = frame
    transform.transform.translation.x, transform.transform.translation.y = x, y
    transform.transform.rotation.w = 1.0
    return transform


def room(x=0.0, **info):
    """An empty map whose corner is at x [m]."""
    grid = OccupancyGrid(info=MapMetaData(**{"resolution": 0.5, "width": 12, "height": 12, **info}), data=[0] * 144)
    grid.info.origin.position.x, grid.info.origin.orientation.w = x, 1.0
    return grid


@unittest.skipIf(CHROMIUM is None, "no chromium")
class PageServerTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = Browser()
        cls.odometry = rospy.Publisher("odom", Odometry, queue_size=1)
        Worker(cls.publish_odometry)
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform([still("map", "odom", *MAP_TO_ODOM)])
        cls.map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        cls.map.publish(room())

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()

    @classmethod
    def publish_odometry(cls):
        message = Odometry(child_frame_id="base_footprint")
        message.header.frame_id = "odom"
        pose = message.pose.pose
        pose.position.x, pose.position.y = POSE
        pose.orientation.z, pose.orientation.w = math.sin(YAW / 2), math.cos(YAW / 2)
        cls.odometry.publish(message)
        return 0.05

    def setUp(self):
        super().setUp()
        if rospy.has_param("/web_teleop_node"):
            rospy.delete_param("/web_teleop_node")
        self.port = free_port()
        self.log = self.processes.folder / "web.log"
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(
            (message.linear.x, message.linear.y, message.angular.z)))

    def start(self, *parameters, **environment):
        server = self.processes.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={self.port}",
                                      *parameters, log=self.log, **environment)
        wait_for(lambda: "drive the robot in a browser" in self.log.read_text(), "the server")
        return server

    def client(self):
        client = Client(self.port)
        client.__enter__()
        self.addCleanup(client.__exit__)
        return client

    def page(self):
        return self.client().ready_page()

    def drive(self, page):
        """Hold a stick until it drives; commands that come too late do not."""
        wait_for(lambda: page.drive(*DRIVE) or DRIVE in self.hand, "the command", period=0.1)

    def open(self, url=None, **options):
        page = self.browser.page(url or f"http://127.0.0.1:{self.port}/", PHONE, **options)
        self.addCleanup(page.close)
        page.wait(OPEN, "the connection")
        return page
