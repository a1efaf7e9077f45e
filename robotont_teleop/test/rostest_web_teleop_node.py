#!/usr/bin/env python3
"""The node of the page: goals, https and token, its end; a STOP over restarts, broken connections and stalls."""

import contextlib
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import rospy
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from move_base_msgs.msg import MoveBaseActionGoal
from nav_msgs.msg import OccupancyGrid, Odometry
from std_srvs.srv import Trigger
from web_client import Client
from web_pages import OPEN, BrowserTest, room, still, values_of

from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.ros.worker import Worker
from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN
from robotont_testing.stalling_proxy import StallingProxy

MOVE_BASE = Path(__file__).resolve().parents[2] / "robotont_map_navigation" / "test" / "move_base_double.py"
DRIVER = "driver_node: command stream"
MAP_TO_ODOM, ODOM_TO_BASE = (1.0, 2.0, 0.0), (0.5, -0.25, 0.6)  # [m, m, rad]
DRIVE, STOP = (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)
RUSH = 160  # commands at once, of 200 a second that a page may send


class PageServerTest(BrowserTest):
    """On the node, with odometry that stands still."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.odometry = rospy.Publisher("odom", Odometry, queue_size=1)
        cls.moving = tf2_ros.TransformBroadcaster()
        Worker(cls.publish_odometry)
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform([still("map", "odom", *MAP_TO_ODOM)])
        cls.map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        cls.map.publish(room())

    @classmethod
    def publish_odometry(cls):
        message = Odometry(child_frame_id="base_footprint")
        message.header.frame_id = "odom"
        message.pose.pose.orientation.w = 1.0
        cls.odometry.publish(message)
        cls.moving.sendTransform(still("odom", "base_footprint", *ODOM_TO_BASE))
        return 0.05

    def setUp(self):
        super().setUp()
        if rospy.has_param("/web_teleop_node"):
            rospy.delete_param("/web_teleop_node")
        self.hand = []
        self.listen("cmd_vel/hand", Twist, lambda message: self.hand.append(values_of(message)))

    def start(self, *parameters, **environment):
        return self.start_server(self.processes, *parameters, **environment)

    def start_driver_node(self):
        self.addCleanup(rospy.set_param, "/emergency_stop_pressed", [])
        self.processes.node("driver_node")

    def pressed(self):
        return self.values(DRIVER)["emergency stop"] != "not pressed"


class WebTeleopNodeTest(PageServerTest):
    def client_page(self):
        """Of no browser."""
        client = Client(self.port)
        client.__enter__()
        self.addCleanup(client.__exit__)
        return client.ready_page()

    def test_a_goal_on_the_map_sends_the_robot_there_and_stop_takes_it_back(self):
        goals = self.listen("move_base/goal", MoveBaseActionGoal)
        statuses = self.listen("move_base/status", GoalStatusArray)
        self.processes.start(MOVE_BASE, "cmd_vel:=cmd_vel/navigation")
        self.start("_oldest_command:=2.0")  # on a busy machine, too, the goal is not late
        page = self.client_page()
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
        server, page = self.start(), self.client_page()

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

    def stop_over_a_restart(self, shown):
        """A page on which STOP was tapped, and shown by this id, before its server ended and started again."""
        server, page = self.start(), self.open()
        page.finger(1, "#stop")
        page.lift()
        page.wait(f"!$('{shown}').hidden", "the stop")
        self.processes.stop(server)
        page.wait(f"!({OPEN})", "the end of the connection")
        self.start()
        page.wait(OPEN, "the new connection")
        return page

    def test_a_stop_outlives_the_pages_server_and_its_release_moves_nothing(self):
        self.start_driver_node()
        page = self.stop_over_a_restart("stopped")
        page.wait("!$('stopped').hidden", "the stop, over a restart of the page's server")
        page.push(1, "#move", 0.0, 0.9)
        self.wait_for_status(DRIVER, WARN)
        rospy.ServiceProxy("emergency_stop/release", Trigger)()
        page.wait("$('can').textContent.includes('Let go of')", "the request to let go")
        self.assertFalse([command for command in self.hand if any(command)])

    def test_a_stop_that_no_driver_has_heard_yet_outlives_the_pages_server(self):
        page = self.stop_over_a_restart("stop_waits")
        self.start_driver_node()
        wait_for(self.pressed, "the stop")
        page.wait("$('stop_waits').hidden && !$('stopped').hidden", "words about the stop")
        rospy.ServiceProxy("emergency_stop/release", Trigger)()

    def test_a_stop_that_a_broken_connection_swallows_goes_out_on_the_next(self):
        self.start_driver_node()
        self.start()
        proxy = StallingProxy(self.port)
        self.addCleanup(proxy.close)
        page = self.open(f"http://127.0.0.1:{proxy.port}/")
        proxy.stall()
        page.finger(1, "#stop")
        page.lift()
        page.wait("$('stop_waits').offsetWidth === innerWidth", "a bar over the whole width")
        self.assertFalse(self.pressed())
        page.wait("window.sockets > 1", "a new connection instead of the dead one")
        proxy.cut()
        proxy.flow()
        wait_for(self.pressed, "the stop")
        page.wait("$('stop_waits').hidden", "the end of the bar")
        page.wait("!$('stopped').hidden", "words about the stop")


class NightlyWebTeleopNodeTest(PageServerTest):
    """Once a day."""

    def test_by_the_token_over_https_and_no_token_in_any_log(self):
        folder = self.processes.folder
        certificate, token_file = folder / "page.pem", folder / "robotont_teleop_token"
        certificate.write_bytes(subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=robot", "-keyout", "-"],
            check=True, stdin=subprocess.DEVNULL, capture_output=True).stdout)
        logs = folder / "log"
        logs.mkdir()
        self.start("_address:=0.0.0.0", f"_certificate:={certificate}", ROS_HOME=str(folder), ROS_LOG_DIR=str(logs))
        token = token_file.read_text().strip()
        url = re.search(rf"https://[^/]+:{self.port}/", self.log.read_text()).group() + "#token=" + token

        stranger = self.browser.page(url)
        self.assertEqual(stranger.run("location.protocol"), "chrome-error:", "the user has not accepted it")
        stranger.close()
        page = self.open(url, any_certificate=True)
        self.assertEqual(page.run("location.protocol + location.pathname + location.search + location.hash"), "https:/")
        cookie, = page.call("Network.getCookies")["cookies"]
        self.assertEqual((cookie["secure"], cookie["httpOnly"], cookie["sameSite"]), (True, True, "Strict"))
        self.assertNotIn(token, cookie["value"])
        page.push_until(lambda: any(x > 0.1 for x, _, _ in self.hand), "the stick's command over wss", "#move", up=0.9)
        page.lift()
        wait_for(lambda: self.hand[-1] == STOP, "the stop")

        for file in logs.rglob("*"):
            if file.is_file():
                self.assertNotIn(token, file.read_text(errors="replace"), file)
        self.assertNotIn(token, self.log.read_text(), "a file is no terminal")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_node_test",
                    NightlyWebTeleopNodeTest if "nightly" in sys.argv else WebTeleopNodeTest)
