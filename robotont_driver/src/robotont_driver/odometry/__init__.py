"""Counts of the wheels and rates of a gyro in; pose, twist, covariance and wheels that slip out."""
