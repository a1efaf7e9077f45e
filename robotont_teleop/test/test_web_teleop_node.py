"""The node of the page, without a browser: its end, https and token."""

import contextlib
import http.client
import signal
import ssl
import subprocess
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from web_client import Client

from robotont_testing import places
from robotont_testing.harness import Master, free_port, in_own_process, wait_for

RUSH = 90  # commands at once: two rushes that come in one second stay below the 200 at which a page is closed


def start(master, port, *parameters, **environment):
    """(process, file of what it prints) of a node that serves."""
    log = master.folder / "web.log"
    log.write_text("")
    server = master.start(places.program("robotont_teleop", "web_teleop_node"), f"_port:={port}", *parameters, log=log,
                          **environment)
    wait_for(lambda: "drive the robot in a browser" in log.read_text(), "the server")
    return server, log


@in_own_process
def test_its_end_amid_a_rush_of_commands_is_a_zero():
    """A signal meets the server at any place, in the middle of publishing a command, too."""
    with Master() as master, Client(free_port()) as client:
        rospy.init_node("hand", disable_signals=True)
        heard = []
        rospy.Subscriber("cmd_vel/hand", Twist, lambda message: heard.append(message.linear.x))
        server, log = start(master, client.port)
        page = client.ready_page()

        def rush_of_commands():
            """At once, and again each second, for those that come too late do not drive; until the page is closed.

            Each behind a zero: whose commands ended amid motion has to let go of its sticks before it drives again.
            """
            while not page.closed:
                page.drive()
                page.send(*[{"kind": "drive", "time": page.time, "x": 0.3, "y": 0.0, "turn": 0.0}] * RUSH)
                time.sleep(1.0)
        rush = threading.Thread(target=rush_of_commands)
        rush.start()
        # not without a pause: that takes the rush its time, and commands that come too late do not drive
        wait_for(lambda: sum(map(bool, heard)) > 20, "the commands", period=0.001)
        assert master.stop(server, signal.SIGTERM) == 0, "it has not ended by itself"
        rush.join()
        wait_for(lambda: heard[-1] == 0.0, "the zero")
        assert "Traceback" not in log.read_text()
        # once more, right behind its start: a signal that met a question to the master
        assert master.stop(start(master, client.port)[0], signal.SIGTERM) == 0, "it has not ended by itself"


def test_by_the_token_over_https_and_no_token_in_any_log():
    with Master() as master:
        port, certificate, logs = free_port(), master.folder / "page.pem", master.folder / "log"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=robot", "-keyout",
                        certificate, "-out", certificate], check=True, stdin=subprocess.DEVNULL, capture_output=True)
        logs.mkdir()
        _, log = start(master, port, "_address:=0.0.0.0", f"_certificate:={certificate}", ROS_HOME=str(master.folder),
                       ROS_LOG_DIR=str(logs))
        token = (master.folder / "robotont_teleop_token").read_text().strip()

        def ask(*request, **headers):
            context = ssl.create_default_context(cafile=str(certificate))
            context.check_hostname = False  # one for any name
            connection = http.client.HTTPSConnection("127.0.0.1", port, context=context, timeout=20)
            with contextlib.closing(connection):
                connection.request(*request, headers=headers)
                answer = connection.getresponse()
                return answer.status, answer.headers, answer.read()
        status, headers, _ = ask("GET", "/")
        assert status == 401
        assert f"wss://127.0.0.1:{port}" in headers["Content-Security-Policy"]
        _, headers, _ = ask("POST", "/login", f"token={token}", Origin=f"https://127.0.0.1:{port}",
                            **{"Content-Type": "application/x-www-form-urlencoded"})
        assert "Secure" in headers["Set-Cookie"]
        assert b'id="stop"' in ask("GET", "/", Cookie=headers["Set-Cookie"].partition(";")[0])[2]
        assert "https://" in log.read_text()
        for file in (*logs.rglob("*"), log):  # a file is no terminal
            assert file.is_dir() or token not in file.read_text(errors="replace"), file
