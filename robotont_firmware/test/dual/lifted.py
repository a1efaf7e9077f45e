"""Imported first: the motors move themselves alone, as those of a lifted robot (60 ms; nothing drags or rubs)."""

from robotont_firmware import config

config.TIME_CONSTANT = 84  # [ms] with the delay of the simulated motors
config.MASS = config.INERTIA = 1
config.EVEN = config.RUBBING = 0
