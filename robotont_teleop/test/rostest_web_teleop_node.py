#!/usr/bin/env python3
"""The node of the page: goals from the page, https and token, its end."""

import contextlib
import math
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import rostest
from actionlib_msgs.msg import GoalStatusArray
from move_base_msgs.msg import MoveBaseActionGoal
from web_pages import DRIVE, MAP_TO_ODOM, POSE, STOP, YAW, PageServerTest

from robotont_map_navigation.goto_client import GOING_ON
from robotont_testing.harness import wait_for

HERE = Path(__file__).resolve().parent
MOVE_BASE = HERE.parents[1] / "robotont_map_navigation" / "test" / "move_base_double.py"
RUSH = 160  # commands at once, of 200 a second that a page may send


def rush_of_commands(page):
    """Commands at once, and again each second, for those that come too late do not drive; until the page is closed."""
    while not page.closed:
        page.send(*[{"kind": "drive", "time": page.time, "x": DRIVE[0], "y": DRIVE[1], "turn": DRIVE[2]}] * RUSH)
        end = time.monotonic() + 1.0
        while not page.closed and time.monotonic() < end:
            time.sleep(0.01)


class WebTeleopNodeTest(PageServerTest):
    def test_a_long_press_on_the_map_sends_the_robot_there_and_stop_takes_the_goal_back(self):
        goals = self.listen("move_base/goal", MoveBaseActionGoal)
        statuses = self.listen("move_base/status", GoalStatusArray)
        self.processes.start(MOVE_BASE, "cmd_vel:=cmd_vel/navigation")
        wait_for(lambda: statuses, "move_base")

        def active():
            return [status for status in statuses[-1].status_list if status.status in GOING_ON]
        self.start()
        page = self.open()
        right, up = 0.4, 0.7

        def wish():
            page.finger(1, "#view", right, up)
            with contextlib.suppress(AssertionError):
                return page.wait("!$('send').hidden", "the preview", 2.0)
            page.lift()  # navigation has not been there when the press began
        wait_for(wish, "the preview")
        page.lift()
        self.assertFalse(goals)
        page.finger(1, "#send")
        page.lift()
        goal = wait_for(lambda: goals and goals[-1].goal.target_pose, "the goal")
        half = page.box("#view")[2] / 2 / page.run("document.querySelector('.world').getScreenCTM().b * -1")
        self.assertEqual(goal.header.frame_id, "map")
        self.assertAlmostEqual(goal.pose.position.x, POSE[0] + MAP_TO_ODOM[0] + up * half, delta=0.02)
        self.assertAlmostEqual(goal.pose.position.y, POSE[1] + MAP_TO_ODOM[1] - right * half, delta=0.02)
        self.assertAlmostEqual(2 * math.atan2(goal.pose.orientation.z, goal.pose.orientation.w), YAW, delta=0.01)
        page.wait("$('message').textContent.includes('to go')", "the way that is left")
        wait_for(active, "an active goal")
        page.finger(1, "#stop")
        page.lift()
        wait_for(lambda: not active(), "the end of the goal")
        page.wait("$('cancel').hidden", "the end of the goal on the page")

    def test_its_end_amid_a_rush_of_commands_is_a_zero(self):
        """A signal meets the server at any place, in the middle of publishing a command, too."""
        server, page = self.start(), self.page()
        rush = threading.Thread(target=rush_of_commands, args=[page])
        rush.start()
        wait_for(lambda: len(self.hand) > RUSH / 8, "the commands", period=0)
        self.assertEqual(self.processes.stop(server, signal.SIGTERM), 0, "it has not ended by itself")
        rush.join()
        wait_for(lambda: self.hand[-1] == STOP, "the zero")
        self.assertNotIn("Traceback", self.log.read_text())
        # once more, right behind its start: a signal that met a question to the master
        self.assertEqual(self.processes.stop(self.start(), signal.SIGTERM), 0, "it has not ended by itself")


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
