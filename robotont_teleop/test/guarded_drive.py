"""A hand drives the simulated robot through guard, limits and firmware, faster than real time."""

import math
import sys
from collections import deque

import numpy as np

from robotont_driver.command.command_stream import CommandStream
from robotont_driver.command.limits import Limits
from robotont_driver.robots.robot_folder import read_wheel_file
from robotont_driver.ros.board_topics import FIELD_OF_VIEW, SENSORS
from robotont_simulator.simulation import Simulation
from robotont_simulator.simulator_node import SCAN_FARTHEST, SCAN_NEAREST
from robotont_simulator.world import World
from robotont_teleop.hand.sensor_view import FAN
from robotont_teleop.mux.guard import Guard
from robotont_testing import places
from robotont_testing.simulated_wheels import touches

sys.path.append(str(places.package("robotont_simulator") / "test"))
from lockstep import LockstepRun

RADIUS = 0.15  # [m] of the footprint
BODY = RADIUS, 0.0175, 0.162  # [m]
WHEELS = read_wheel_file(places.config("wheel_params.yaml"))[0]
SCAN_BOUNDS, CONE_BOUNDS = (SCAN_NEAREST, SCAN_FARTHEST), (0.04, 4.0)  # [m]
LIMITS = Limits(wheel_speed=1.5, linear_acceleration=1.5, angular_acceleration=8.0,
                linear_deceleration=2.25)  # as shipped
PERIOD = 0.02  # [s]
SPEEDS = (0.1, 0.2, 0.3, 0.5, 0.65, 0.8)  # [m/s] of hands
SCAN_PERIODS, SCAN_DELAY = 5, 2  # periods between two scans, and until a scan is heard
AROUND, CAMERA = np.linspace(-math.pi, math.pi, 360, endpoint=False), np.linspace(-0.515, 0.515, 128)
CONE, RAYS = FIELD_OF_VIEW * FAN, np.linspace(-math.pi, math.pi, 1440, endpoint=False)


def place(x=0.0, y=0.0, yaw=0.0, height=0.1, roll=0.0, pitch=0.0):
    """As the guard wants it, of a sensor; angles [rad] as of a static_transform_publisher."""
    rotation = np.eye(3)
    for axis, angle in enumerate((roll, pitch, yaw)):
        cos, sin = math.cos(angle), math.sin(angle)
        turn = np.roll([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]], axis, (0, 1))
        rotation = turn.dot(rotation)
    return rotation, (x, y, height)


def make_guard(blind_speed=0.3):
    """Of the shipped robot."""
    return Guard(BODY, LIMITS.linear_acceleration, blind_speed)


class GuardedDrive:
    """angles: of the laser's rays [rad], or None for the twelve range sensors of the official robot."""

    def __init__(self, boxes, start, angles=AROUND, bounds=SCAN_BOUNDS):
        self.simulation = Simulation(WHEELS, World(tuple(boxes), start))
        self.guard = make_guard()
        self._bounds = bounds
        self.angles, self.touched, self.nearest = angles, False, math.inf
        self.held = 0  # periods in which something was in the way
        self._boxes = boxes
        self._run = LockstepRun(self.simulation)
        self._stream = CommandStream(self._run.kinematics, LIMITS, 0.5, PERIOD)
        self._heard, self._ticks, self._moved = deque(), 0, (0.0, 0.0, 0.0)
        self.now = 100.0  # [s]

    def drive(self, twist, seconds):
        """The hand asks for the twist; the fastest speed over ground [m/s] meanwhile."""
        fastest = 0.0
        for _ in range(round(seconds / PERIOD)):
            self._ticks += 1
            self.now = 100.0 + self._ticks * PERIOD
            if self._ticks % SCAN_PERIODS == 0:
                self._heard.append((self._ticks + SCAN_DELAY, self._look(self.now)))
            while self._heard and self._heard[0][0] <= self._ticks:
                for reading in self._heard.popleft()[1]:
                    self.guard.see(*reading)
            self.guard.moves(self._moved, self.now)  # as the odometry tells it a period later
            self._moved = self.simulation.twist()
            limited = self.guard.limit(twist, self.now)
            self.held += bool(self.guard.held and self.guard.held[0] == self.now)
            self._stream.command((*limited[:2], 0.0), (0.0, 0.0, limited[2]), self.now)
            self._run.drive([self._stream.twist(self.now)])
            self.touched |= touches(self.simulation)
            self.nearest = min(self.nearest, self.gap())
            fastest = max(fastest, math.hypot(*self.simulation.twist()[:2]))
        return fastest

    def gap(self):
        """[m] between the footprint and the next box."""
        x, y, _ = self.simulation.pose()
        return min((box.distance(x, y) for box in self._boxes), default=math.inf) - RADIUS

    def _look(self, at):
        """Arguments of `Guard.see`."""
        if self.angles is not None:
            return [("laser", place(), self.angles, self.simulation.scan(self.angles, *self._bounds), self._bounds, at)]
        readings, ranges = [], self.simulation.scan(RAYS, 0.0, SCAN_FARTHEST)
        shown = np.isfinite(ranges)
        points = ranges[shown] * np.exp(1j * RAYS[shown])
        for sensor, (distance, bearing, view) in enumerate(SENSORS):
            x, y, yaw = distance * math.cos(bearing), -distance * math.sin(bearing), -view
            before_it = (points - complex(x, y)) * np.exp(-1j * yaw)
            nearest = abs(before_it[abs(np.angle(before_it)) <= CONE[-1]]).min(initial=math.inf)
            measured = -math.inf if nearest < CONE_BOUNDS[0] else nearest if nearest < CONE_BOUNDS[1] else math.inf
            readings.append((sensor, place(x, y, yaw), CONE, np.full(len(CONE), measured), CONE_BOUNDS, at))
        return readings
