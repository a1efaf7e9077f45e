"""From the robot's motion to its wheels' and back: chapter 3 of the thesis, for n wheels.

In go wheel geometry, twists (v_x, v_y, omega) [m/s, rad/s], and wheel paths. Out come wheel speeds, twists and poses.
"""
