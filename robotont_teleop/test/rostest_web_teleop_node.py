#!/usr/bin/env python3
"""The node of the page without a robot: goals, camera, https and QR code in a real browser; emergency stop; its end."""

import contextlib
import io
import itertools
import math
import signal
import socket
import subprocess
import time
import unittest
import unittest.mock
from pathlib import Path

import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import TransformStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from PIL import Image
from qr_on_terminal import read_qr
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Bool
from web_client import Client

from robotont_driver.node import Worker
from robotont_teleop import camera
from robotont_testing import places
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import free_port, wait_for
from robotont_testing.node_test import WARN, NodeTest
from robotont_testing.stalling_proxy import StallingProxy

MOVE_BASE = Path(__file__).resolve().parents[2] / "robotont_map_navigation" / "test" / "move_base_double.py"
CAMERA = "camera/color/image_raw/compressed"
POSE, MAP_TO_ODOM = (0.5, -0.25), (1.0, 2.0)  # [m]
YAW = 0.6             # [rad]
SCALE = 100.0         # [px/m] of the page when it opens
DRIVE, STOP = (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)
OPEN = "document.getElementById('app')?.dataset.state === 'open'"  # not yet on the login page
LOG_SOCKETS = """window.sockets = 0;
window.sent = [];
const Real = WebSocket;
window.WebSocket = class extends Real {
  constructor(address) {
    super(address);
    window.sockets++;
  }

  send(text) {
    window.sent.push(text);
    super.send(text);
  }
};"""
ACTIVE = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


def jpeg(number, size=(64, 48)):
    """A picture in whose end, behind what decoders read, stands a number."""
    output = io.BytesIO()
    Image.new("RGB", size, (40 * number % 256, 120, 200)).save(output, "JPEG")
    return output.getvalue() + f"{number:08d}".encode()


@unittest.skipIf(CHROMIUM is None, "no chromium")
class WebTeleopNodeTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser = Browser()
        cls.odometry = rospy.Publisher("odom", Odometry, queue_size=1)
        Worker(cls.publish_odometry)
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        transform = TransformStamped(child_frame_id="odom")
        transform.header.frame_id = "map"
        transform.transform.translation.x, transform.transform.translation.y = MAP_TO_ODOM
        transform.transform.rotation.w = 1.0
        cls.broadcaster.sendTransform(transform)
        cls.map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        room = OccupancyGrid()
        room.info.resolution, room.info.width, room.info.height = 0.5, 12, 12
        room.info.origin.orientation.w = 1.0
        room.data = [0] * 144
        cls.map.publish(room)

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

    def start(self, *parameters):
        server = self.processes.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={self.port}",
                                      *parameters, log=self.log)
        wait_for(lambda: "drive the robot in a browser" in self.log.read_text(), "the server")
        return server

    def client(self):
        client = Client(self.port)
        client.__enter__()
        self.addCleanup(client.__exit__)
        return client

    def page(self):
        page = self.client().page()
        wait_for(lambda: {"hello", "state", "status"} <= set(page.messages), "the first messages")
        return page

    def drive(self, page):
        """Hold a stick until it drives; commands that come too late do not."""
        wait_for(lambda: page.drive(*DRIVE) or DRIVE in self.hand, "the command", period=0.1)

    def open(self, url=None, **options):
        page = self.browser.page(url or f"http://127.0.0.1:{self.port}/", PHONE, **options)
        self.addCleanup(page.close)
        page.wait(OPEN, "the connection")
        return page

    # Goals

    def start_move_base(self):
        goals = self.listen("move_base/goal", MoveBaseActionGoal)
        statuses = self.listen("move_base/status", GoalStatusArray)
        self.processes.start(MOVE_BASE, "_repeat:=true", "cmd_vel:=cmd_vel/navigation")
        wait_for(lambda: statuses, "move_base")
        return goals, lambda: [status for status in statuses[-1].status_list if status.status in ACTIVE]

    def test_a_tap_on_the_map_sends_the_robot_there_and_stop_takes_the_goal_back(self):
        goals, active = self.start_move_base()
        self.start()
        page = self.open()
        page.wait("!document.getElementById('goal').hidden", "the target button")
        page.finger(1, "#goal")
        page.lift()
        page.wait("document.getElementById('goal').getAttribute('aria-pressed') === 'true'", "the choice of a place")
        right, up = 0.4, 0.7
        page.finger(1, "#view", right, up)
        page.lift()
        goal = wait_for(lambda: goals and goals[-1].goal.target_pose, "the goal")
        half = page.box("#view")[2] / 2 / SCALE
        self.assertEqual(goal.header.frame_id, "map")
        self.assertAlmostEqual(goal.pose.position.x, POSE[0] + MAP_TO_ODOM[0] + up * half, delta=0.02)
        self.assertAlmostEqual(goal.pose.position.y, POSE[1] + MAP_TO_ODOM[1] - right * half, delta=0.02)
        self.assertAlmostEqual(2 * math.atan2(goal.pose.orientation.z, goal.pose.orientation.w), YAW, delta=0.01)
        page.wait("document.getElementById('message').textContent.includes('to go')", "the way that is left")
        wait_for(active, "an active goal")
        self.addCleanup(self.publisher("emergency_stop", Bool).publish, False)
        page.finger(1, "#stop")
        page.lift()
        wait_for(lambda: not active(), "the end of the goal")
        page.wait("document.getElementById('cancel').hidden", "the end of the goal on the page")

    def test_of_many_goals_the_newest_is_pursued_and_none_waits(self):
        goals, active = self.start_move_base()
        self.start()
        page = self.page()
        wait_for(lambda: page.messages["status"]["navigation"], "navigation")
        page.order("goal", x=0.0, y=1.0)
        wait_for(active, "the first goal")
        for number in range(1, 8):
            page.order("goal", x=0.5 * number, y=1.0)
        newest = wait_for(lambda: goals and goals[-1].goal.target_pose.pose.position.x == 3.5 and goals[-1],
                          "the newest goal", timeout=5)
        wait_for(lambda: [status.goal_id.id for status in active()] == [newest.goal_id.id], "only the newest goal")
        wait_for(lambda: page.messages["status"]["goal"] and page.messages["status"]["goal"]["x"] == 3.5 and
                 "to go" in page.messages["status"]["goal"]["words"], "the goal on the page")
        page.order("goal", x=1.0, y=0.0)
        page.send({"kind": "cancel"})
        wait_for(lambda: not active() and page.messages["status"]["goal"] is None, "the end of all goals")
        seen = len(goals)
        time.sleep(1.0)  # in which a goal that waits would be sent
        self.assertEqual((len(goals), active()), (seen, []))
        page.order("goal", x=200.0, y=0.0)
        wait_for(lambda: "Failed to find a valid plan" in page.messages["status"]["note"]["words"], "move_base's words")

    # Camera

    def get_picture(self, client, after):
        status, _, body = client.request("GET", f"/camera.jpg?after={after}")
        return int(body[-8:]) if status == 200 else None

    def start_camera(self):
        publisher = self.publisher(CAMERA, CompressedImage, subscribers=0)
        self.start()
        client = self.client()
        page = client.page()
        wait_for(lambda: page.messages.get("status", {}).get("camera"), "the camera")
        return publisher, client, page

    def test_the_camera_is_shown_its_newest_picture_only(self):
        publisher, client, _ = self.start_camera()
        page = self.open()
        page.wait("!document.getElementById('film').hidden", "the camera's button")
        page.finger(1, "#film")
        page.lift()
        wait_for(lambda: publisher.get_num_connections(), "the node")
        width = "document.getElementById('camera').naturalWidth"
        wait_for(lambda: publisher.publish(CompressedImage(format="jpeg", data=jpeg(1))) or page.run(width) == 64,
                 "the picture", period=0.05)
        wait_for(lambda: publisher.publish(CompressedImage(format="jpeg", data=jpeg(2, (96, 48)))) or
                 page.run(width) == 96, "the next one", period=0.05)
        publisher.publish(CompressedImage(format="png", data=b"\x89PNG" + jpeg(9)))
        for number in range(10, 30):
            publisher.publish(CompressedImage(format="jpeg", data=jpeg(number)))
        got, after = [], 0
        while not got or got[-1] != 29:
            status, headers, body = client.request("GET", f"/camera.jpg?after={after}")
            self.assertEqual((status, headers["Content-Type"]), (200, "image/jpeg"))
            after = headers["X-Picture"]
            got.append(int(body[-8:]))
        self.assertLessEqual(len([number for number in got if number >= 10]), 3, "pictures of the past")
        page.wait("!document.getElementById('camera').hasAttribute('src')", "the end of a picture that is old")
        self.assertEqual([words for words in page.complaints() if "404" not in str(words)], [])

    def test_no_command_waits_behind_a_picture(self):
        publisher, _, page = self.start_camera()
        reader = socket.create_connection(("127.0.0.1", self.port))
        self.addCleanup(reader.close)
        reader.sendall(f"GET /camera.jpg HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
        wait_for(lambda: publisher.get_num_connections(), "the node")
        size = 20_000_000
        publisher.publish(CompressedImage(format="jpeg", data=jpeg(1) + bytes(size)))
        start = reader.recv(100)  # the answer has begun; nobody reads its rest
        self.assertTrue(start.startswith(b"HTTP/1.1 200"))
        self.drive(page)
        page.send({"kind": "ping", "time": 7.0})
        wait_for(lambda: "pong" in page.messages, "the answer")
        reader.settimeout(10.0)
        read = 0
        while read < size:
            read += len(reader.recv(1 << 20))
        self.assertGreater(read, size)

    def test_a_camera_that_nobody_watches_is_left_and_an_old_picture_is_none(self):
        publisher = self.publisher(CAMERA, CompressedImage, subscribers=0)
        watched = camera.Camera(CAMERA)
        with unittest.mock.patch.object(camera, "REST", 1.5):
            watched.look({rospy.resolve_name(CAMERA)})
            watched.picture()
            wait_for(publisher.get_num_connections, "the subscription")
            publisher.publish(CompressedImage(format="png", data=b"\x89PNG"))
            picture = wait_for(lambda: watched.picture() or publisher.publish(CompressedImage(data=jpeg(1))),
                               "the picture", period=0.05)
            self.assertEqual(picture[1], jpeg(1), "what is no JPEG must be left out")
            wait_for(lambda: watched.picture() is None, "the end of the old picture", timeout=3)
            self.assertTrue(publisher.get_num_connections())
            wait_for(lambda: watched.look({}) or not publisher.get_num_connections(), "the end of the subscription")

    # In the network

    def test_by_the_qr_code_over_https_and_no_token_in_any_log(self):
        folder = self.processes.folder
        cert, key, token_file = folder / "cert.pem", folder / "key.pem", folder / "token"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=robot", "-out",
                        cert, "-keyout", key], check=True, stdin=subprocess.DEVNULL, capture_output=True)
        logs = folder / "log"
        logs.mkdir()
        self.processes.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={self.port}",
                             "_address:=0.0.0.0",
                             f"_certificate:={cert}", f"_certificate_key:={key}", f"_token_file:={token_file}",
                             log=self.log, ROS_LOG_DIR=str(logs))
        wait_for(lambda: "asked for once" in self.log.read_text(), "the server")
        token = token_file.read_text().strip()
        url = read_qr(self.log.read_text().splitlines())
        self.assertRegex(url, rf"^https://[^/]+:{self.port}/#token={token}$")

        stranger = self.browser.page(url)
        self.assertEqual(stranger.run("location.protocol"), "chrome-error:", "the user has not accepted it")
        stranger.close()
        page = self.open(url, any_certificate=True)
        self.assertEqual(page.run("location.protocol + location.pathname + location.search + location.hash"), "https:/")
        cookie, = page.call("Network.getCookies")["cookies"]
        self.assertEqual((cookie["secure"], cookie["httpOnly"], cookie["sameSite"]), (True, True, "Strict"))
        self.assertNotIn(token, cookie["value"])
        page.finger(1, "#move", 0.0, 0.6)
        wait_for(lambda: any(x > 0.1 for x, _, _ in self.hand), "the stick's command over wss")
        page.lift()
        wait_for(lambda: self.hand[-1] == STOP, "the stop")

        with socket.create_connection(("127.0.0.1", self.port)) as plain:
            plain.settimeout(10.0)
            plain.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
            with contextlib.suppress(ConnectionResetError):
                self.assertNotIn(b"HTTP", plain.recv(1000))
        for file in logs.rglob("*"):
            if file.is_file():
                self.assertNotIn(token, file.read_text(errors="replace"), file)
        self.assertEqual(self.log.read_text().count(token), 1, "once, for the one who sits there")

    # Emergency stop

    def test_an_emergency_stop_reaches_whoever_starts_later_and_only_a_person_releases_it(self):
        stops = self.listen("emergency_stop", Bool)
        rospy.set_param("/emergency_stop_pressed", False)
        server = self.start()
        page = self.page()
        page.send({"kind": "stop"})
        wait_for(lambda: page.messages["state"]["stopped"], "the stop")
        driver = self.processes.node("driver_node")
        self.wait_for_status("driver_node: command stream", WARN, "emergency stop")
        self.processes.stop(server)
        self.log.write_text("")
        self.start()
        page = self.page()
        self.assertTrue(page.messages["state"]["stopped"], "forgotten over a restart of the page's server")
        self.assertTrue(all(stop.data for stop in stops), "released by a start or an end")

        page.send({"kind": "stop"})  # which this server latches
        wait_for(lambda: len(stops) > 1, "the stop")
        self.publisher("emergency_stop", Bool, subscribers=3).publish(False)
        wait_for(lambda: not page.messages["state"]["stopped"], "the release by somebody else")
        self.processes.stop(driver)
        self.status.clear()
        self.processes.node("driver_node")
        wait_for(lambda: "driver_node: command stream" in self.status, "driver_node")
        self.publisher("emergency_stop", Bool, subscribers=3)
        seen = self.status["driver_node: command stream"]
        wait_for(lambda: self.status["driver_node: command stream"] is not seen, "newer diagnostics")
        self.assertEqual(self.values("driver_node: command stream")["emergency stop"], "not pressed",
                         "a press that was released lives on")

    def open_through_proxy(self):
        """(page, proxy); the page counts its sockets and keeps what it sends."""
        self.addCleanup(rospy.set_param, "/emergency_stop_pressed", False)
        rospy.set_param("/emergency_stop_pressed", False)
        self.start()
        proxy = StallingProxy(self.port)
        self.addCleanup(proxy.close)
        return self.open(f"http://127.0.0.1:{proxy.port}/", script=LOG_SOCKETS), proxy

    def test_a_stop_that_a_broken_connection_swallows_goes_out_on_the_next(self):
        stops = self.listen("emergency_stop", Bool)
        page, proxy = self.open_through_proxy()
        proxy.stall()
        page.finger(1, "#stop")
        page.lift()
        page.wait("document.getElementById('message').textContent.includes('has not reached')", "words for the driver")
        self.assertFalse(stops)
        page.wait("window.sockets > 1", "a new connection instead of the dead one")
        proxy.cut()
        proxy.flow()
        wait_for(lambda: stops, "the stop")
        page.wait("document.getElementById('message').hidden", "the end of these words")
        page.wait("!document.getElementById('stopped').hidden", "words about the stop")

    def test_a_release_that_a_stall_holds_up_releases_nothing(self):
        stops = self.listen("emergency_stop", Bool)
        page, proxy = self.open_through_proxy()
        page.finger(1, "#stop")
        page.lift()
        page.wait("!document.getElementById('stopped').hidden", "words about the stop")
        page.finger(2, "#release")
        page.wait("document.getElementById('release').classList.contains('filling')", "the hold")
        proxy.stall("up")
        page.wait("window.sent.some((text) => text.includes('release'))", "the release, which waits on its way")
        page.lift()
        then = page.run("performance.now()")
        wait_for(lambda: page.run("performance.now()") > then + 250, "a release that is too old")
        proxy.flow()
        page.wait("document.getElementById('message').textContent.includes('too late')", "words for the driver")
        self.assertTrue(all(stop.data for stop in stops))
        page.finger(2, "#release")
        wait_for(lambda: not stops[-1].data, "the release that is held anew")
        page.lift()

    # Its end

    def test_its_end_while_driving_is_a_zero(self):
        for end in (signal.SIGINT, signal.SIGTERM):
            self.log.write_text("")
            self.hand.clear()
            server = self.start()
            page = self.page()
            self.drive(page)
            self.processes.stop(server, end)
            self.assertEqual([command for command, _ in itertools.groupby(self.hand)], [DRIVE, STOP])
            self.assertNotIn("Traceback", self.log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_node_test", WebTeleopNodeTest)
