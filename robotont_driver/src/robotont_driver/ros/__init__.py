"""What the nodes share of ROS: start and end, parameters, diagnostics, workers.

In go ROS messages and the parameter server's values. Out come nodes that wait for nobody on a command's way.
"""
