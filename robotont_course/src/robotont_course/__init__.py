"""What courses use beside the robot: topics of their exercises."""
