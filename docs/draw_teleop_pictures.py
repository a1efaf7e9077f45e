#!/usr/bin/env python3
"""Draws the pictures of the page for driving by hand: draw_teleop_pictures.py [FOLDER]. Needs Chromium.

The simulated robot drives in the room, on the map of the room, as a thumb on each stick commands it.
"""

import math
import socket
import sys
from pathlib import Path

import rospy
from nav_msgs.msg import Odometry

from robotont_testing.browser import DESKTOP, PHONE, PHONE_LYING, Browser
from robotont_testing.harness import Master, free_port, wait_for

PICTURES = (  # name, size, dark
    ("teleop_phone_light", (*PHONE[:2], 2), False), ("teleop_phone_dark", (*PHONE[:2], 2), True),
    ("teleop_phone_lying", (*PHONE_LYING[:2], 2), True),
    ("teleop_desktop_light", DESKTOP, False), ("teleop_desktop_dark", DESKTOP, True))
THUMBS = (0.12, 0.4, -0.3)  # left stick right and up, right stick right: a circle that stays clear of the walls
WAY = 1.1             # [m] for each picture


def main():
    """Make all pictures, in docs/pictures or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with Master() as master, Browser() as browser:
        rospy.init_node("pictures", disable_signals=True)
        port = free_port()
        poses = []
        rospy.Subscriber("odom", Odometry, lambda message: poses.append(message.pose.pose.position), queue_size=1)
        master.launch("simulation.launch", "world:=room", "world_map:=true", f"port:={master.folder / 'robotont'}",
                      "teleop:=true", f"web_port:={port}")
        wait_for(lambda: poses, "odometry", timeout=60)
        wait_for(lambda: answers(port), "the page", timeout=60)
        for name, size, dark in PICTURES:
            page = browser.page(f"http://127.0.0.1:{port}/", size, dark)
            page.wait("document.querySelectorAll('#lights li').length >= 5", "the robot's health", timeout=60)
            take_in_motion(page, poses, folder / f"{name}.png")
            page.lift()
            page.close()


def answers(port):
    """Whether the page's server is there."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def take_in_motion(page, poses, path):
    """A picture of the page while the robot drives; again where the connection has stumbled meanwhile."""
    def taken():
        drive(page, poses)
        page.screenshot(path)
        return page.run("document.getElementById('message').hidden")
    wait_for(taken, "a picture in motion", timeout=120)


def drive(page, poses):
    """Hold both sticks until the robot has gone WAY; let go first where the page asks for it."""
    start = len(poses)

    def gone():
        if "Let go" in page.text("#message"):
            page.lift()
        if not page.touched:
            right, up, turn = THUMBS
            page.finger(1, "#move", right, up)
            page.finger(2, "#turn", turn)
        way = poses[start - 1:]
        return sum(math.hypot(after.x - before.x, after.y - before.y) for before, after in zip(way, way[1:])) > WAY
    wait_for(gone, "the drive", period=0.1, timeout=60)
    wait_for(lambda: gone() and float(page.text("#speed")) > 0.1 and page.run(
        "document.getElementById('message').hidden"), "motion", period=0.05)


if __name__ == "__main__":
    main()
