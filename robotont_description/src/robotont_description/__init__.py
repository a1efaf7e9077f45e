"""Visualisation of Robotont: its model and its geometry."""
