"""The robot's footprint by move_base's parameters."""

import rospy

from robotont_driver.parameters.parameters import is_number

COSTMAP = "move_base/global_costmap/"


def needed_radius():
    """[m] of the circle that move_base keeps free around the robot, by its parameters; 0 when they name none."""
    values = [rospy.get_param(COSTMAP + name, 0.0) for name in ("robot_radius", "footprint_padding")]
    return sum(values) if all(map(is_number, values)) else 0.0


def base_frame():
    """The robot's frame."""
    return rospy.get_param(COSTMAP + "robot_base_frame", "base_link")


def odometry_frame():
    """The frame of the odometry, in which the local costmap lies."""
    return rospy.get_param("move_base/local_costmap/global_frame", "odom")
