"""Robots by name: config/robots/NAME, or a folder of the same form.

In go names and files. Out come the geometry of the wheels and the parameters of one robot.
"""
