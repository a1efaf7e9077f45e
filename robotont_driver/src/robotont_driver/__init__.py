"""Drive a robot with n >= 3 omni wheels: kinematics, odometry, the serial link, and the ROS nodes.

Nodes are in modules named after them (`*_node`), on top of `node`, `packet_topics` and `serial_link`. All that is not
listed in test_pure.py is pure: no ROS, no port, no clock. `dialects` holds one module per kind of board.
"""
