"""Drive a robot with n >= 3 omni wheels.

Each folder is a room; a room imports only from those that stand before it here: parameters, timing, kinematics, robots,
odometry, protocol, link, command, ros, nodes and tools. Rooms up to command are pure, but for link: no ROS, no clock.
"""
