"""RViz on a virtual screen, and a robot on a stand-in board to look at. For tests and pictures."""

import math
import os
import struct
import threading
from pathlib import Path

import numpy as np
import rospy
import yaml
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from PIL import Image

from robotont_testing.harness import START, Processes, wait_for
from robotont_testing.places import package
from robotont_testing.robots import robot_folder
from robotont_testing.stand_in_board import Board

WIDTH, HEIGHT = 1280, 800  # [pixels] of the screen
SPEED = 0.8                # [m/s] of a drive
TURNING = 1.5              # [rad/s]
FRAME_RATE = 5             # [1/s] of a picture that nobody watches: without a graphics card 30 take a whole processor


class Stage(Processes):
    """A screen beside the ROS master that the environment names; programs started here show windows on it."""

    def __init__(self):
        super().__init__()
        number = self.folder / "display"
        # The server takes a free display and reports its number. Its picture lies in a file.
        self.start("Xvfb", "-displayfd", "1", "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "+extension", "GLX",
                   "-nolisten", "tcp", "-nocursor", "-fbdir", self.folder, log=number)
        self._screen = {
            "DISPLAY": ":" + wait_for(lambda: _last_number(number), "the X server"),
            "LIBGL_ALWAYS_SOFTWARE": "1", "HOME": str(self.folder), "XDG_RUNTIME_DIR": str(self.folder),
        }

    def show(self, file, *arguments, log=None):
        """Start a launch file whose windows go to the screen; returns its Popen."""
        before = {name: os.environ.get(name) for name in self._screen}
        os.environ.update(self._screen)
        try:
            return self.launch(file, *arguments, log=log)
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value

    def picture(self):
        """Picture of the screen: HEIGHT x WIDTH x 3 integers of 0 to 255: red, green, blue."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", data[:100])  # of an X window dump
        start = header[0] + 12 * header[19]         # behind the header and the colour map
        pixels = np.frombuffer(data, np.uint8, HEIGHT * header[12], start).reshape(HEIGHT, header[12] // 4, 4)
        return pixels[:, :WIDTH, 2::-1].astype(np.int16)


class Robot:
    """robot.launch on a stand-in board. `pose`: (x [m], y [m], yaw [rad]) of the newest odom."""

    def __init__(self, stage, namespace="", parameters=None):
        prefix = namespace + "/" if namespace else ""
        name = namespace or "robot"
        self.arguments = [f"namespace:=/{namespace}"]
        wheels = 3
        if parameters:
            self.arguments.append("robot:=" + robot_folder(stage.folder / (name + "_robot"), parameters))
            wheels = parameters["wheelAmount"]
        self.board = Board(str(stage.folder / name), wheels)
        self.board.plug()
        self.pose = None
        self._arrived = threading.Event()
        self._goal = None
        self._command = rospy.Publisher(f"/{prefix}cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber(f"/{prefix}odom", Odometry, self._on_odometry, tcp_nodelay=True)
        self._stage = stage
        self._launch = stage.launch("robot.launch", f"port:={self.board.link}", "mux:=false", *self.arguments)
        wait_for(lambda: self.pose, "odometry of " + name, START)

    def _on_odometry(self, message):
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        self.pose = (position.x, position.y, 2 * math.atan2(turn.z, turn.w))
        if self._goal:
            command = approach(self.pose, self._goal)
            if command is None:
                self._goal = None
                self._arrived.set()
            self._command.publish(command or Twist())

    def drive_to(self, goal, timeout=30.0):
        """Drive straight to (x [m], y [m], yaw [rad]) in odom and stop there, within 2 mm and 0.2 degrees."""
        self._arrived.clear()
        self._goal = goal
        assert self._arrived.wait(timeout), f"did not get to {goal} in {timeout} s but to {self.pose}"

    def close(self):
        """End the driver and unplug the board."""
        self._stage.stop(self._launch)
        self.board.__exit__()


def approach(pose, goal):
    """The Twist at `pose` towards `goal` (both x [m], y [m], yaw [rad]); None within 2 mm and 0.2 degrees."""
    x, y = goal[0] - pose[0], goal[1] - pose[1]
    turn = math.remainder(goal[2] - pose[2], 2 * math.pi)
    distance = math.hypot(x, y)
    if distance < 0.002 and abs(turn) < 0.0035:
        return None
    speed = min(SPEED, 3.0 * distance) / max(distance, 1e-9)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    command = Twist()
    command.linear.x, command.linear.y = speed * (cos * x + sin * y), speed * (cos * y - sin * x)
    command.angular.z = max(-TURNING, min(TURNING, 3.0 * turn))
    return command


def seen_from_above(config, folder):
    """Copy as by `drawn_seldom` that opens with its saved view "From above"; returns (file, view).

    view: the dictionary of the view, with Scale [pixels/m] and the X, Y [m] of the middle of the picture.
    """
    content = _drawn_seldom(config)
    views = content["Visualization Manager"]["Views"]
    above = next(view for view in views["Saved"] if view["Name"] == "From above")
    views["Current"] = {**above, "Name": "Current View"}
    return _written(content, Path(folder) / config), above


def drawn_seldom(config, folder):
    """Copy of an RViz configuration that draws FRAME_RATE pictures a second; returns the file."""
    return _written(_drawn_seldom(config), Path(folder) / config)


def _drawn_seldom(config):
    content = yaml.safe_load((package("robotont_description") / "rviz" / config).read_text())
    content["Visualization Manager"]["Global Options"]["Frame Rate"] = FRAME_RATE
    return content


def _written(content, file):
    file.write_text(yaml.safe_dump(content))
    return file


def _last_number(file):
    numbers = [line for line in file.read_text().splitlines() if line.isdigit()] if file.exists() else []
    return numbers[-1] if numbers else None


def save_picture(picture, file):
    """Write a picture (height x width x 3 integers of 0 to 255) as a PNG file with 128 colours, a small one."""
    image = Image.fromarray(picture.astype(np.uint8))
    image.quantize(128, dither=Image.Dither.NONE if hasattr(Image, "Dither") else 0).save(str(file), optimize=True)
