"""What the launch files and the command line need beside the nodes: goals, the robot's size, missing packages."""
