"""Robots by name, config/robots/NAME or a folder like it: out come the wheels' geometry and the parameters."""
