"""Robotont without Robotont: the firmware's own loop on a simulated board, MuJoCo for the physics."""
