"""Drive a robot with n >= 3 omni wheels.

Each folder is a room; a room imports only from those that stand before it here: parameters, kinematics, robots,
odometry, protocol, command, link, rospy_repairs, ros and nodes. Up to command they are pure: no node, no port,
no clock; of ROS they know where a package lies.
"""
