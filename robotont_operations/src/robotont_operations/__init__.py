"""Running Robotont day by day: network check, installation on the robot, status, black box, report."""
