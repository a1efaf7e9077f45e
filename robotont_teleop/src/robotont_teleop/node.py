"""Code shared by the nodes of this package."""

import gc
import sys

import rospy
from geometry_msgs.msg import Twist

from robotont_driver.node import init_node, own_parameters


def run_node(name, node_class, table):
    """Start a node that is called with its parameters, and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    node_class(own_parameters(table))
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while messages wait
    rospy.spin()


def twist_message(twist):
    """geometry_msgs/Twist of (v_x [m/s], v_y [m/s], omega [rad/s])."""
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = twist
    return message
