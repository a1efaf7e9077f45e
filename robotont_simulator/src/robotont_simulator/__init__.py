"""Robotont without Robotont: the firmware's own loop on a simulated board, MuJoCo for the physics.

world: walls and boxes, and the map drawn from them. model: the robot as MuJoCo sees it. simulation: the
physics, motors and encoders. board: the firmware's board interface over it. fast: a PC and a board in one
process, without a clock. ROS: simulator_node.
"""
