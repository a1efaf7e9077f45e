#!/usr/bin/env python3
"""Drives the simulated robot to goals with the real move_base, as a user does, and measures by ground truth.

navigation_run.py [--goal X Y YAW]... [--random N --seed S] [launch arguments, e.g. localization:=fake] prints JSON: for
each goal the exit status and last line of goto, the error of the end pose, the least distance between the robot's body
and the world, the way in directions that the camera does not see, and what navigation_monitor reported. Of N random
goals every third lies with its centre 0.2 to 0.3 m from a wall, so that the next way begins there. Needs move_base; has
a ROS master of its own.
"""

import argparse
import json
import math
import random
import subprocess
import sys
import time

import numpy as np
import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry

from robotont_description.geometry import robot_radius
from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.world import read_world
from robotont_testing.harness import Master, wait_for
from robotont_testing.places import config, program

GOAL_TIMEOUT = 180  # [s]
NEAR = (0.2, 0.3)   # [m] between a wall and the robot's centre
HALF_A_VIEW = 1.03 / 2  # [rad] of the camera to each side
TRUTH_RATE = 50.0   # [Hz]


def clearance(place, world, radius):
    """[m] between a round robot of `radius` at (x, y) and the nearest wall or box; negative: they overlap."""
    return min(box.distance(*place) for box in world.solids) - radius


def random_goals(world, count, seed):
    """`count` poses (x, y, yaw). Every third one is NEAR [m] from a wall or box, between its centre and the face."""
    draw, goals = random.Random(seed), []
    corners = [(box.x, box.y) for box in world.solids]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    while len(goals) < count:
        x, y = (round(draw.uniform(low[axis], high[axis]), 2) for axis in (0, 1))
        distance = clearance((x, y), world, 0.0)
        if NEAR[0] <= distance <= NEAR[1] if len(goals) % 3 == 2 else distance > NEAR[1]:
            goals.append((x, y, round(draw.uniform(-math.pi, math.pi), 2)))
    return goals


class Simulated:
    """A launch file with a simulated robot, whose true odometry is recorded."""

    def __init__(self, master, file, *arguments):
        self.truth, log = [], master.folder / "log"
        launch = master.launch(file, "sim:=true", f"port:={master.folder / 'board'}", *arguments, log=log)
        rospy.init_node("navigation_run", disable_signals=True)
        rospy.Subscriber("ground_truth/odom", Odometry, self.truth.append, tcp_nodelay=True)
        wait_for(lambda: self.truth or launch.poll() is not None, "the simulator", timeout=60)
        assert launch.poll() is None, log.read_text()

    def pose(self):
        """True (x, y, yaw) of the robot."""
        return pose_of(self.truth[-1].pose.pose)


class Run(Simulated):
    """navigation.launch and what is recorded beside it."""

    def __init__(self, master, arguments, robot, world, start=None):
        """start: (x, y, yaw) of the robot, and of amcl unless the arguments give it another; None: the world's."""
        self.radius = robot_radius(read_robot(robot).wheels)
        file = config(f"worlds/{world}.yaml")
        self.world, place = read_world(file), world
        if start:
            arguments = ["start:=" + " ".join(map(str, start)), *arguments]
            moved = {**yaml.safe_load(file.read_text()), "start": start}
            place = master.folder / "world.yaml"
            place.write_text(yaml.safe_dump(moved))
        super().__init__(master, "navigation.launch", f"robot:={robot}", f"world:={place}",
                         f"map:={config(f'maps/{world}.yaml')}", *arguments)
        self.reports = []
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)

    def _on_diagnostics(self, message):
        self.reports += [status for status in message.status if status.name == "navigation_monitor: localization"]

    def goto(self, x, y, yaw):
        """Run goto and wait for its end; the figures."""
        for record in self.truth, self.reports:
            record.clear()
        wait_for(lambda: self.truth and any("no map" not in report.message for report in self.reports),
                 "the simulator and its map", timeout=60)
        self.reports.clear()
        start = time.monotonic()
        result = subprocess.run(["timeout", str(GOAL_TIMEOUT), program("robotont_map_navigation", "goto"), str(x),
                                 str(y), str(yaw)], check=False, text=True, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT)
        duration = time.monotonic() - start
        wait_for(lambda: standing(self.truth[-1]), "the robot to stand")
        truth, end = tuple(self.truth), self.pose()
        return {
            "goal": [x, y, yaw], "status": result.returncode, "words": result.stdout.strip().splitlines()[-1],
            "seconds": round(duration, 1),
            "way": round(way(truth), 2),
            "error_m": round(math.dist(end[:2], (x, y)), 3),
            "error_rad": round(abs(math.remainder(end[2] - yaw, 2 * math.pi)), 3),
            "clearance_m": round(min(clearance(pose_of(message.pose.pose)[:2], self.world, self.radius)
                                     for message in truth), 3),
            "unseen_m": round(sum(speed(message) for message in truth if abs(math.atan2(
                message.twist.twist.linear.y, message.twist.twist.linear.x)) > HALF_A_VIEW) / TRUTH_RATE, 2),
            "fastest_m_s": round(max(map(speed, truth)), 3),
            "alarms": sorted({report.message for report in self.reports if report.level}),
        }


def speed(message):
    """[m/s] of an Odometry over ground."""
    return math.hypot(message.twist.twist.linear.x, message.twist.twist.linear.y)


def way(truth):
    """[m] through the places of Odometry messages."""
    places = [pose_of(message.pose.pose)[:2] for message in truth]
    return sum(math.dist(one, other) for one, other in zip(places, places[1:]))


def standing(message):
    return max(speed(message), abs(message.twist.twist.angular.z)) < 5e-3


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--goal", nargs=3, type=float, action="append", metavar=("X", "Y", "YAW"))
    parser.add_argument("--random", type=int, default=0, metavar="N", help="as many random goals")
    parser.add_argument("--seed", type=int, default=1, help="of the random goals [%(default)s]")
    parser.add_argument("--world", default="room")
    parser.add_argument("--start", nargs=3, type=float, metavar=("X", "Y", "YAW"), help="of the robot and of amcl")
    parser.add_argument("--robot", default="thesis")
    options, arguments = parser.parse_known_args()
    with Master() as master:
        run = Run(master, arguments, options.robot, options.world, options.start)
        figures = []
        goals = options.goal or random_goals(run.world, options.random, options.seed)
        for goal in goals or [[8.0, 8.0, 1.57]]:
            figures.append(run.goto(*goal))
            print(json.dumps(figures[-1]), file=sys.stderr, flush=True)
    print(json.dumps(figures))
    return max(figure["status"] for figure in figures)


if __name__ == "__main__":
    sys.exit(main())
