#!/usr/bin/env python3
"""The node of the page, without a browser: goals, its end, https and token, and a STOP over its restart."""

import contextlib
import http.client
import math
import signal
import ssl
import subprocess
import threading
import time
from pathlib import Path

import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import TransformStamped, Twist
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from web_client import Client, room

from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.ros.worker import Worker
from robotont_testing import places
from robotont_testing.harness import free_port, wait_for
from robotont_testing.node_test import NodeTest

MOVE_BASE = Path(__file__).resolve().parents[2] / "robotont_map_navigation" / "test" / "move_base_double.py"
MAP_TO_ODOM, ODOM_TO_BASE = (1.0, 2.0, 0.0), (0.5, -0.25, 0.6)  # [m, m, rad]
DRIVE, STOP = (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)
RUSH = 160  # commands at once, of 200 a second that a page may send


def transform(frame, child, x, y, yaw):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = frame, rospy.Time.now()
    message.transform.translation.x, message.transform.translation.y = x, y
    message.transform.rotation.z, message.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return message


class WebTeleopNodeTest(NodeTest):
    """With odometry that stands still."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.port = free_port()
        cls.odometry = rospy.Publisher("odom", Odometry, queue_size=1)
        cls.moving = tf2_ros.TransformBroadcaster()
        Worker(cls.publish_odometry)
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform([transform("map", "odom", *MAP_TO_ODOM)])
        cls.map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        cls.map.publish(room())

    @classmethod
    def publish_odometry(cls):
        message = Odometry(child_frame_id="base_footprint")
        message.header.frame_id = "odom"
        message.pose.pose.orientation.w = 1.0
        cls.odometry.publish(message)
        cls.moving.sendTransform(transform("odom", "base_footprint", *ODOM_TO_BASE))
        return 0.05

    def setUp(self):
        super().setUp()
        if rospy.has_param("/web_teleop_node"):
            rospy.delete_param("/web_teleop_node")
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(
            (message.linear.x, message.linear.y, message.angular.z)))

    def start(self, *parameters, **environment):
        self.log = self.processes.folder / "web.log"
        self.log.write_text("")
        server = self.processes.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={self.port}",
                                      *parameters, log=self.log, **environment)
        wait_for(lambda: "drive the robot in a browser" in self.log.read_text(), "the server")
        return server

    def page(self):
        client = Client(self.port)
        client.__enter__()
        self.addCleanup(client.__exit__)
        return client.ready_page()

    def test_a_goal_on_the_map_sends_the_robot_there_and_stop_takes_it_back(self):
        goals = self.listen("move_base/goal", MoveBaseActionGoal)
        statuses = self.listen("move_base/status", GoalStatusArray)
        self.processes.start(MOVE_BASE, "cmd_vel:=cmd_vel/navigation")
        self.start("_oldest_command:=2.0")  # on a busy machine, too, the goal is not late
        page = self.page()
        status = lambda: page.messages["status"]  # noqa: E731
        wait_for(lambda: status()["navigation"] and status()["frame"] == "map", "navigation, and a place on the map")
        pose = MAP_TO_ODOM[0] + ODOM_TO_BASE[0], MAP_TO_ODOM[1] + ODOM_TO_BASE[1], ODOM_TO_BASE[2]
        for told, real in zip(page.messages["state"]["pose"], pose):
            self.assertAlmostEqual(told, real, places=3)

        def ask():  # again, as a person whom a busy computer has told that it was too late
            page.order("goal", x=2.0, y=1.0)
            with contextlib.suppress(AssertionError):
                return wait_for(lambda: goals and goals[-1].goal.target_pose, "the goal", 5.0)
        goal = wait_for(ask, "the goal")
        self.assertEqual(goal.header.frame_id, "map")
        for given, real in zip(pose_of(goal.pose), (2.0, 1.0, pose[2])):  # it looks as it looked
            self.assertAlmostEqual(given, real, places=3)
        wait_for(lambda: "to go" in (status()["goal"] or {"words": ""})["words"], "the way that is left")

        def active():
            return [one for one in statuses[-1].status_list if one.status in (
                GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)]
        wait_for(active, "an active goal")
        page.send({"kind": "stop"})
        wait_for(lambda: not active(), "the end of the goal")
        wait_for(lambda: status()["goal"] is None, "the end of the goal on the page")

    def test_its_end_amid_a_rush_of_commands_is_a_zero(self):
        """A signal meets the server at any place, in the middle of publishing a command, too."""
        server, page = self.start(), self.page()

        def rush_of_commands():
            """At once, and again each second, for those that come too late do not drive; until the page is closed."""
            while not page.closed:
                page.send(*[dict(zip(("kind", "time", "x", "y", "turn"), ("drive", page.time, *DRIVE)))] * RUSH)
                end = time.monotonic() + 1.0
                while not page.closed and time.monotonic() < end:
                    time.sleep(0.01)
        rush = threading.Thread(target=rush_of_commands)
        rush.start()
        wait_for(lambda: len(self.hand) > RUSH / 8, "the commands", period=0)
        self.assertEqual(self.processes.stop(server, signal.SIGTERM), 0, "it has not ended by itself")
        rush.join()
        wait_for(lambda: self.hand[-1] == STOP, "the zero")
        self.assertNotIn("Traceback", self.log.read_text())
        # once more, right behind its start: a signal that met a question to the master
        self.assertEqual(self.processes.stop(self.start(), signal.SIGTERM), 0, "it has not ended by itself")

    def test_a_stop_that_no_driver_has_heard_waits_over_a_restart_and_its_release_moves_nothing(self):
        """The page sends it again (modules.test.mjs) until it is `pressed_here`."""
        def told(stopped, waits, here):
            state = page.messages["state"]
            return (state["stopped"], state["stop_waits"], state["pressed_here"]) == (stopped, waits, here)
        server, page = self.start(), self.page()
        page.send({"kind": "stop"})
        wait_for(lambda: told(True, True, False), "a stop that waits")
        self.processes.stop(server)
        self.start()
        page = self.page()
        self.assertTrue(told(False, False, False), "it knows nothing")
        page.send({"kind": "stop"})
        wait_for(lambda: told(True, True, False), "a stop that waits")
        self.addCleanup(rospy.set_param, "/emergency_stop_pressed", [])
        self.processes.node("driver_node")
        wait_for(lambda: told(True, False, True), "the driver's word")
        number = page.messages["hello"]["page"]
        wait_for(lambda: page.drive(*DRIVE) or page.messages["state"]["held"] == [number], "the held stick",
                 period=0.05)

        def release():
            page.drive(*DRIVE)
            page.order("release", pressed_at=page.messages["state"]["pressed_at"])
            return told(False, False, False)
        wait_for(release, "the release", period=0.2)
        for _ in range(10):
            page.drive(*DRIVE)
            time.sleep(0.05)
        self.assertFalse([command for command in self.hand if any(command)])

    def test_by_the_token_over_https_and_no_token_in_any_log(self):
        folder, logs = self.processes.folder, self.processes.folder / "log"
        certificate = folder / "page.pem"
        certificate.write_bytes(subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=robot", "-keyout", "-"],
            check=True, stdin=subprocess.DEVNULL, capture_output=True).stdout)
        logs.mkdir()
        self.start("_address:=0.0.0.0", f"_certificate:={certificate}", ROS_HOME=str(folder), ROS_LOG_DIR=str(logs))
        token = (folder / "robotont_teleop_token").read_text().strip()
        self.assertRegex(self.log.read_text(), rf"https://[^/]+:{self.port}/")

        def ask(*request, **headers):
            context = ssl.create_default_context(cafile=str(certificate))
            context.check_hostname = False  # one for any name
            connection = http.client.HTTPSConnection("127.0.0.1", self.port, context=context, timeout=20)
            with contextlib.closing(connection):
                connection.request(*request, headers=headers)
                answer = connection.getresponse()
                return answer.status, answer.headers, answer.read()
        status, headers, page = ask("GET", "/")
        self.assertEqual((status, b'id="stop"' in page), (401, False))
        self.assertIn(f"wss://127.0.0.1:{self.port}", headers["Content-Security-Policy"])
        _, headers, _ = ask("POST", "/login", f"token={token}", Origin=f"https://127.0.0.1:{self.port}",
                            **{"Content-Type": "application/x-www-form-urlencoded"})
        cookie = headers["Set-Cookie"]
        for word in ("Secure", "HttpOnly", "SameSite=Strict"):
            self.assertIn(word, cookie)
        self.assertNotIn(token, cookie)
        self.assertIn(b'id="stop"', ask("GET", "/", Cookie=cookie.partition(";")[0])[2])
        for file in (*logs.rglob("*"), self.log):  # a file is no terminal
            if file.is_file():
                self.assertNotIn(token, file.read_text(errors="replace"), file)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_node_test", WebTeleopNodeTest)
