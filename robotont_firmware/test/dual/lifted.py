"""Imported first: the motors move themselves alone, as those of a lifted robot (60 ms; nothing drags or rubs)."""

from robotont_firmware import config, gain_bounds

config.LEAD = config.TURN_LEAD = config.FREE_LEAD
config.ARC = gain_bounds.NO_ARC
config.TURN_DRAG = 0
