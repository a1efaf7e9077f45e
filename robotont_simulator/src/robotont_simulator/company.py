"""Several robots in one world, robot1, robot2, ...: each has its own physics, and sees the others there."""

import re

import rospy
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry

from robotont_driver.kinematics.se2 import compose
from robotont_driver.parameters.parameters import Parameter, ParameterError
from robotont_simulator.world import read_world

APART = 0.5  # [m] between the starts, to the left of the first
ROBOTS = Parameter("robots", 1, "in this world: robot1, robot2, ...; this namespace is one of them",
                   minimum=1, maximum=9)


def shared(world, robots, namespace):
    """(the World as the robot in that namespace has it, numbers of the others, from 1 on). Raises ValueError."""
    if robots == 1:
        return world, []
    found = re.fullmatch(f"/?robot([1-{robots}])/?", namespace)
    if not found:
        raise ValueError(f"robots: found the namespace {namespace} of {robots} robots, "
                         f"allowed: robot1 to robot{robots}")
    start = compose(world.start, (0.0, APART * (int(found[1]) - 1), 0.0))
    return (world._replace(start=start, others=robots - 1),
            [number for number in range(1, robots + 1) if number != int(found[1])])


def world_of(parameters):
    """`shared` for a node's parameters. Raises ParameterError."""
    try:
        return shared(read_world(parameters["world"]), parameters["robots"], rospy.get_namespace())
    except (OSError, ValueError) as error:
        raise ParameterError([str(error)]) from None


def watch_visitor(put):
    """Call put(0, x, y) with each place [m] that the visitor is given."""
    rospy.Subscriber("simulator_node/visitor", Vector3, lambda message: put(0, message.x, message.y))


def watch(others, put):
    """Call put(place, x, y) with the true places [m] of the others, place: 1, 2, ...."""
    def told(message, place):
        put(place, message.pose.pose.position.x, message.pose.pose.position.y)
    for place, number in enumerate(others, 1):
        rospy.Subscriber(f"/robot{number}/ground_truth/odom", Odometry, told, place, queue_size=1, tcp_nodelay=True)
