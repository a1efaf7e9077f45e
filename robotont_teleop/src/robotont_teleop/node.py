"""What the nodes of this package share."""

import gc
import sys

import rospy
from geometry_msgs.msg import Twist

from robotont_driver.parameters import ParameterError, read_parameters


def read_own_parameters(table):
    """The private parameters of this node by name; with wrong ones say which and exit with 1."""
    try:
        return read_parameters(table, rospy.get_param("~", {}))
    except ParameterError as error:
        for fault in error.faults:
            rospy.logfatal("wrong parameter %s", fault)
        sys.exit(1)


def run_node(name, node_class, table):
    """Start a node that is called with its parameters, and serve until ROS shuts down."""
    rospy.init_node(name)
    node_class(read_own_parameters(table))
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while messages wait
    rospy.spin()


def twist_message(twist):
    """geometry_msgs/Twist of (v_x [m/s], v_y [m/s], omega [rad/s])."""
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = twist
    return message
