"""Wheel parameters from measured runs, and odometry against the truth."""
