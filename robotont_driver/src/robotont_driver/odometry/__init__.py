"""Where the robot is, and how sure that is.

In go counts of the wheels and turning rates of a gyro. Out come pose, twist and covariance, and wheels that slip.
"""
