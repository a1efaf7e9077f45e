"""The stack at work without a robot."""
