"""Puts the firmware on a board; runs on the PC."""
