#!/usr/bin/env python3
"""The node of the page, without a browser: its end, https and token."""

import contextlib
import http.client
import signal
import ssl
import subprocess
import threading
import time

import rospy
import rostest
from geometry_msgs.msg import Twist
from web_client import Client

from robotont_testing import places
from robotont_testing.harness import free_port, wait_for
from robotont_testing.node_test import NodeTest

DRIVE, STOP = (0.3, 0.0, 0.0), (0.0, 0.0, 0.0)
RUSH = 160  # commands at once, of 200 a second that a page may send


class WebTeleopNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.port = free_port()
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
        status, headers, _ = ask("GET", "/")
        self.assertEqual(status, 401)
        self.assertIn(f"wss://127.0.0.1:{self.port}", headers["Content-Security-Policy"])
        _, headers, _ = ask("POST", "/login", f"token={token}", Origin=f"https://127.0.0.1:{self.port}",
                            **{"Content-Type": "application/x-www-form-urlencoded"})
        self.assertIn("Secure", headers["Set-Cookie"])
        self.assertIn(b'id="stop"', ask("GET", "/", Cookie=headers["Set-Cookie"].partition(";")[0])[2])
        for file in (*logs.rglob("*"), self.log):  # a file is no terminal
            if file.is_file():
                self.assertNotIn(token, file.read_text(errors="replace"), file)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_node_test", WebTeleopNodeTest)
