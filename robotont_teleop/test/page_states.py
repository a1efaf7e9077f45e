"""Twelve states of a robot, as its page shows them: for the pictures of docs and for the tests of how it looks."""

import io
import math
import time
from types import SimpleNamespace

import numpy as np
from nav_msgs.msg import MapMetaData, OccupancyGrid
from PIL import Image, ImageDraw

from robotont_teleop.hand.fault_keys import fault_key
from robotont_teleop.hand.robot_reports import worst_first
from robotont_teleop.web.page_pictures import map_picture

WALLS, CELL = (4.0, 6.0), 0.05  # [m]
PLACE, RADIUS = (2.2, 3.0), 0.8  # [m] the circle that the robot drives
TASKS = ("serial_com_node: link", "serial_com_node: board", "driver_node: command stream", "odom_node: wheel feedback",
         "cmd_vel_mux: who drives", "cmd_vel_mux: guard")
LEFT = (0.12, 0.13, 0.24, 0.5, 1.6, 1.6, 1.6, 1.6)  # [m] what is near, from ahead to the left
BY_HAND = {"moves": True, "mover": ["page", ""], "driven_by": "hand"}
STATES = {  # what the robot tells beside the usual; fault: (task, level, words); me: this page drives
    "nobody": {},
    "you": {**BY_HAND, "me": True, "thumb": True},
    "another page": {**BY_HAND, "other": True},
    "a program": {"moves": True, "mover": ["program", "square"]},
    "navigation": {"moves": True, "mover": ["navigation", "move_base"], "driven_by": "navigation",
                   "goal": {"x": 2.4, "y": 1.2, "words": "1.32 m to go"}, "navigation": True},
    "STOP": {"me": True, "stopped": True},
    "STOP not arrived": {"moves": True, "mover": ["program", "square"], "stopped": True, "stop_waits": True},
    "board unplugged": {"fault": (TASKS[0], 2, "/dev/ttyACM0: no such file: is the board plugged in?")},
    "wheel blocked": {**BY_HAND, "me": True, "thumb": True,
                      "fault": (TASKS[3], 1, "wheel 2 stands although it is driven: blocked?")},
    "guard": {"me": True, "camera": True, "near": [*LEFT, *[None] * 9, *LEFT[:0:-1]],
              "fault": (TASKS[5], 1, "in the way: something ahead, 0.12 m from the robot")},
    "battery": {"battery": {"voltage": 9.9, "charge": 0.08}, "fault": (TASKS[1], 1, "the battery is low: charge it")},
    "no connection": {"closed": True},
}


def tell(server, told):
    """Let the robot tell this; page 1 or another one has its seat, or nobody."""
    seat = server.server.seat
    seat.leave(seat.driver)
    if told.get("me") or told.get("other"):
        seat.take(1 if told.get("me") else 99)
    robot, kind = server.robot, type(server.robot)
    grid = np.zeros((round(WALLS[1] / CELL), round(WALLS[0] / CELL)), dtype=np.int8)
    grid[[0, -1]] = grid[:, [0, -1]] = 100
    message = OccupancyGrid(info=MapMetaData(resolution=CELL, width=grid.shape[1], height=grid.shape[0]),
                            data=grid.ravel().tolist())
    message.info.origin.orientation.w = 1.0
    robot.map_picture, where = map_picture(message)
    file = io.BytesIO()
    camera_picture().save(file, "JPEG")
    robot.camera = SimpleNamespace(picture=lambda: (time.monotonic_ns(), file.getvalue()))
    fault = told.get("fault", ("", 0, ""))

    def state():
        angle = time.monotonic() / 4 if told.get("moves") else 1.0
        pose = [PLACE[0] + RADIUS * math.cos(angle), PLACE[1] + RADIUS * math.sin(angle), angle + math.pi / 2]
        speeds = [0.2, 0.0, 0.25] if told.get("moves") else [0.0, 0.0, 0.0]
        robot.pose = pose
        usual = {**kind.state(robot), "pose": pose, "velocity": speeds}
        return {**usual, **{key: value for key, value in told.items() if key in usual}}

    def status():
        lights = [{"name": name, "level": 0, "words": "well", "key": ""} for name in TASKS if name != fault[0]]
        if fault[0]:
            lights.append({"name": fault[0], "level": fault[1], "words": fault[2], "key": fault_key(*fault[::2])})
        x, y, yaw = robot.pose
        ranges = [round(min(((WALLS[axis] if part > 0 else 0.0) - place) / part for axis, (place, part) in enumerate(
            ((x, math.cos(yaw + ray)), (y, math.sin(yaw + ray)))) if abs(part) > 1e-6), 2)
            for ray in np.linspace(-math.pi, math.pi, 180)]
        usual = {**kind.status(robot), "lights": worst_first(lights), "frame": "map", "map": where, "battery": {
            "voltage": 11.6, "charge": 0.82}, "board": "robotont_firmware 2.0.0 wheels 3",
            "radius": 0.15, "near": [min(2.0, ranges[(90 + 180 * sector // 24) % 180] - 0.15) for sector in range(24)],
            "scan": {"from": [0, 0, 0], "first": -math.pi, "step": 2 * math.pi / 179, "ranges": ranges}}
        return {**usual, **{key: value for key, value in told.items() if key in usual}}
    state()
    robot.state, robot.status = state, status


def camera_picture():
    """A room with a box right before the robot."""
    picture = Image.new("RGB", (640, 480), "#d9d4c7")
    draw = ImageDraw.Draw(picture)
    draw.polygon([(0, 480), (0, 330), (170, 250), (470, 250), (640, 330), (640, 480)], "#9a8467")
    draw.line([(0, 330), (170, 250), (470, 250), (640, 330)], "#6d6557", 4)
    draw.line([(170, 0), (170, 250)], "#bdb6a6", 3)
    draw.line([(470, 0), (470, 250)], "#bdb6a6", 3)
    draw.polygon([(215, 470), (215, 215), (430, 215), (430, 470)], "#a8703c")
    draw.polygon([(215, 215), (245, 185), (405, 185), (430, 215)], "#c98f56")
    draw.line([(322, 215), (322, 470)], "#8a5a2e", 5)
    return picture
