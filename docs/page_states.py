"""Twelve states of a robot, as its page shows them: for draw_teleop_pictures.py."""

import io
import math
import time
from types import SimpleNamespace

import numpy as np
from nav_msgs.msg import MapMetaData, OccupancyGrid
from page_client import report
from PIL import Image, ImageDraw

from robotont_teleop.web.page_pictures import map_picture

WALLS, CELL = (4.0, 6.0), 0.05  # [m]
POSE = [2.6, 3.7, 2.6]  # [m, m, rad]
TASKS = ("serial_com_node: link", "serial_com_node: board", "driver_node: command stream", "odom_node: wheel feedback",
         "cmd_vel_mux: who drives", "cmd_vel_mux: guard")
LEFT = (0.12, 0.13, 0.24, 0.5, 1.6, 1.6, 1.6, 1.6)  # [m] what is near, from ahead to the left
BY_HAND = {"moves": True, "mover": ["page", ""], "driven_by": "hand"}
STATES = {  # what the robot tells beside the usual; fault: {task: (level, words)}; me: this page drives
    "nobody": {},
    "you": {**BY_HAND, "me": True, "thumb": True},
    "another page": {**BY_HAND, "other": True},
    "a program": {"moves": True, "mover": ["program", "square"]},
    "navigation": {"moves": True, "mover": ["navigation", "move_base"], "driven_by": "navigation",
                   "goal": {"x": 2.4, "y": 1.2, "words": "1.32 m to go"}, "navigation": True},
    "STOP": {"me": True, "stopped": True},
    "STOP not arrived": {"moves": True, "mover": ["program", "square"], "stopped": True, "stop_waits": True},
    "board unplugged": {"fault": {TASKS[0]: (2, "/dev/ttyACM0: no such file: is the board plugged in?")}},
    "wheel blocked": {**BY_HAND, "me": True, "thumb": True,
                      "fault": {TASKS[3]: (1, "wheel 2 stands although it is driven: blocked?")}},
    "guard": {"me": True, "camera": True, "near": [*LEFT, *[None] * 9, *LEFT[:0:-1]],
              "fault": {TASKS[5]: (1, "in the way: something ahead, 0.12 m from the robot")}},
    "battery": {"battery": {"voltage": 9.9, "charge": 0.08}, "fault": {TASKS[1]: (1, "the battery is low: charge it")}},
    "no connection": {"closed": True},
}


def tell(server, told):
    """Let the robot tell this; page 1 or another one has its seat, or nobody."""
    seat, robot = server.server.seat, server.robot
    seat.leave(seat.driver)
    if told.get("me") or told.get("other"):
        seat.take(1 if told.get("me") else 99)
    grid = np.zeros((round(WALLS[1] / CELL), round(WALLS[0] / CELL)), dtype=np.int8)
    grid[[0, -1]] = grid[:, [0, -1]] = 100
    message = OccupancyGrid(info=MapMetaData(resolution=CELL, width=grid.shape[1], height=grid.shape[0]),
                            data=grid.ravel().tolist())
    message.info.origin.orientation.w = 1.0
    robot.map_picture, where = map_picture(message)
    file = io.BytesIO()
    camera_picture().save(file, "JPEG")
    robot.camera = SimpleNamespace(picture=lambda: (time.monotonic_ns(), file.getvalue()))
    x, y, yaw = POSE
    rays = np.linspace(-math.pi, math.pi, 180)
    ranges = [round(min(((WALLS[axis] if part > 0 else 0.0) - place) / part for axis, (place, part) in enumerate(
        ((x, math.cos(yaw + ray)), (y, math.sin(yaw + ray)))) if abs(part) > 1e-6), 2)
        for ray in rays]
    given = {"pose": POSE, "velocity": [0.2, 0.0, 0.25] if told.get("moves") else [0.0, 0.0, 0.0]}
    status = {"frame": "map", "map": where, "battery": {"voltage": 11.6, "charge": 0.82}, "radius": 0.15,
              "near": [min(2.0, ranges[(90 + 180 * sector // 24) % 180] - 0.15) for sector in range(24)],
              "scan": [[length * math.cos(ray), length * math.sin(ray)] for length, ray in zip(ranges, rays)]}
    for fields, kind in ((given, robot.state), (status, robot.status)):
        fields.update({key: value for key, value in told.items() if key in kind()})
    report(server, {**dict.fromkeys(TASKS, (0, "well")), **told.get("fault", {})}, given, **status)


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
