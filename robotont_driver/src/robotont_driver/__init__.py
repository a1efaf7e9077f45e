"""Drive a robot with n >= 3 omni wheels. Each folder is a room, and imports only from those before it here.

parameters, kinematics, robots, odometry, protocol, command (up to here pure: no node, no port, no clock; of ROS they
know where a package lies), link, rospy_repairs, ros, nodes.
"""
