"""Robotont without Robotont: the firmware's own loop on a simulated board, MuJoCo for the physics.

world: walls and boxes, and the map drawn from them. mujoco_model: the robot as MuJoCo sees it. simulation: the
physics, motors and encoders. simulated_board: the board interface over it. lockstep: a PC and a board in one
process, without a clock. simulator_node: in ROS, in real time.
"""
