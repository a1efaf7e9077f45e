"""Drive a robot with n >= 3 omni wheels: kinematics, odometry, the serial link, and the ROS nodes.

Pure modules (no ROS, no port, no clock): parameters, wheels, kinematics, limits, command_stream,
protocol, odometry, ideal_motors. The port: serial_link. ROS: node, driver_node, serial_com_node, odom_node,
mock_serial_node.
"""
