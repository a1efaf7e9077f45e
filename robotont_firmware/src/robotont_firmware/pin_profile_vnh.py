"""Wiring profile "vnh": as "ours", with VNH2SP30 or VNH5019 motor drivers."""

from robotont_firmware.pin_profile import *  # noqa: F403 (on the PC that is "ours")

PROFILE = "vnh"
DESCRIPTION = "as ours, with VNH2SP30 or VNH5019 motor drivers"

STATIC = 400  # [effort] friction, and the drop of the diode through which current goes on in the off phase
TEST_EFFORT = 600  # [effort] turns a free wheel at 11 units; 400 do at 13 with drivers that brake
