"""Several robots in one world, robot1, robot2, ...: each has its own physics, and sees the others there."""

import math
import re

import rospy
from nav_msgs.msg import Odometry

from robotont_driver.parameters.parameters import Parameter
from robotont_simulator.world import WorldError

APART = 0.5  # [m] between the starts, to the left of the first
ROBOTS = Parameter("robots", 1, "in this world: robot1, robot2, ...; this namespace is one of them",
                   minimum=1, maximum=9)


def numbers(robots, namespace):
    """(number of the robot in a namespace, those of the others), from 1 on. Raises WorldError."""
    if robots == 1:
        return 1, []
    found = re.fullmatch("/?robot([1-9])/?", namespace)
    if not found or int(found[1]) > robots:
        raise WorldError(f"robots: found the namespace {namespace} of {robots} robots, "
                         f"allowed: robot1 to robot{robots}")
    return int(found[1]), [number for number in range(1, robots + 1) if number != int(found[1])]


def start_of(start, number):
    """(x, y [m], yaw [rad]) where a robot begins, beside the first, which begins at `start`."""
    x, y, yaw = start
    away = APART * (number - 1)
    return x - away * math.sin(yaw), y + away * math.cos(yaw), yaw


def shared(world, robots):
    """(the World as the robot in this node's namespace has it, numbers of the others). Raises WorldError."""
    number, others = numbers(robots, rospy.get_namespace())
    return world._replace(start=start_of(world.start, number), others=len(others)), others


def watch(others, put):
    """Call put(place, x, y) with the true places [m] of the others, place: 0, 1, ...."""
    def told(message, place):
        put(place, message.pose.pose.position.x, message.pose.pose.position.y)
    for place, number in enumerate(others):
        rospy.Subscriber(f"/robot{number}/ground_truth/odom", Odometry, told, place, queue_size=1, tcp_nodelay=True)
