"""Helpers of the launch files: the check for missing packages."""
