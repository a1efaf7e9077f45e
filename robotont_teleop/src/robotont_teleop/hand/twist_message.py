"""Twists of this package as messages."""

from geometry_msgs.msg import Twist


def twist_message(twist):
    """geometry_msgs/Twist of (v_x [m/s], v_y [m/s], omega [rad/s])."""
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = twist
    return message
