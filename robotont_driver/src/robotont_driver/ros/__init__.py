"""What nodes are made of: start and end, parameters, diagnostics, threads, and parts that one node has of its own.

In go ROS messages and the parameter server's values. Out come nodes that wait for nobody on a command's way.
"""
