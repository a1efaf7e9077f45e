"""Twists [m/s, rad/s] in, the n wheels' speeds out, and back: chapter 3 of the thesis; poses in the plane."""
