"""Gamepads as their kernel drivers describe them (evtest, as their owners publish it): buttons, axes, states at rest.

Codes are those of Linux' input-event-codes.h. Buttons are numbered from BTN_SOUTH (0x130) on, except in mode D.
"""

from typing import Dict, NamedTuple, Tuple

from evdev import AbsInfo, ecodes
from evdev.ecodes import ABS_BRAKE, ABS_GAS, ABS_HAT0X, ABS_HAT0Y, ABS_RX, ABS_RY, ABS_RZ, ABS_X, ABS_Y, ABS_Z


class RecordedPad(NamedTuple):
    """One model with one driver, and what of it is meant to drive."""

    buttons: Tuple[int, ...]
    axes: Dict[int, AbsInfo]     # with the values at rest
    left_stick: Tuple[int, int]  # axes to the right and down
    right_stick: int             # axis to the right
    left_shoulder: int
    right_shoulder: int
    right_hand_button: int       # of the four
    triggers: Tuple[int, int]    # analogue, left and right

    @property
    def capabilities(self):
        return {ecodes.EV_KEY: list(self.buttons), ecodes.EV_ABS: list(self.axes.items())}


def axis(rest, lowest, highest, fuzz=0, flat=0):
    return AbsInfo(value=rest, min=lowest, max=highest, fuzz=fuzz, flat=flat, resolution=0)


def sticks(x, y, right_x, right_y, *limits):
    """Axes of two sticks, by their values at rest."""
    return {code: axis(rest, *limits) for code, rest in zip((ABS_X, ABS_Y, ABS_RX, ABS_RY), (x, y, right_x, right_y))}


HAT = {ABS_HAT0X: axis(0, -1, 1), ABS_HAT0Y: axis(0, -1, 1)}
TRIGGERS = {ABS_Z: axis(0, 0, 255), ABS_RZ: axis(0, 0, 255)}
MICROSOFT = (0x130, 0x131, 0x133, 0x134, 0x136, 0x137, 0x13A, 0x13B, 0x13C, 0x13D, 0x13E)
AS_XPAD = ((ABS_X, ABS_Y), ABS_RX, 0x136, 0x137, 0x131, (ABS_Z, ABS_RZ))
SIXTEEN_BITS = (-32768, 32767, 16, 128)

PADS = {
    "Microsoft X-Box 360 pad, xpad": RecordedPad(
        MICROSOFT, {**sticks(0, -1, 0, -1, *SIXTEEN_BITS), **TRIGGERS, **HAT}, *AS_XPAD),
    "Logitech Gamepad F710 in mode X, xpad": RecordedPad(
        MICROSOFT, {**sticks(128, -129, 128, -129, *SIXTEEN_BITS), **TRIGGERS, **HAT}, *AS_XPAD),
    "Xbox Wireless Controller by Bluetooth, xpadneo; worn sticks": RecordedPad(
        MICROSOFT,
        {ABS_X: axis(2765, -32768, 32767, 0, 4095), ABS_Y: axis(825, -32768, 32767, 0, 4095),
         ABS_Z: axis(1, 0, 1023, 3, 63), ABS_RX: axis(-152, -32768, 32767, 255, 4095),
         ABS_RY: axis(1338, -32768, 32767, 255, 4095), ABS_RZ: axis(0, 0, 1023, 3, 63), **HAT}, *AS_XPAD),
    "Xbox Wireless Controller by Bluetooth, hid-generic": RecordedPad(
        (28, 158, 240, *range(0x130, 0x13F), 410),
        {ABS_X: axis(31673, 0, 65535, 255, 4095), ABS_Y: axis(32915, 0, 65535, 255, 4095),
         ABS_Z: axis(32082, 0, 65535, 255, 4095), ABS_RZ: axis(32239, 0, 65535, 255, 4095),
         ABS_GAS: axis(0, 0, 1023, 3, 63), ABS_BRAKE: axis(0, 0, 1023, 3, 63), **HAT},
        (ABS_X, ABS_Y), ABS_Z, 0x136, 0x137, 0x131, (ABS_BRAKE, ABS_GAS)),
    "Sony DualShock 4, hid-generic": RecordedPad(
        tuple(range(0x130, 0x13E)),
        {ABS_X: axis(127, 0, 255, 0, 15), ABS_Y: axis(129, 0, 255, 0, 15), ABS_Z: axis(128, 0, 255, 0, 15),
         ABS_RX: axis(0, 0, 255, 0, 15), ABS_RY: axis(0, 0, 255, 0, 15), ABS_RZ: axis(127, 0, 255, 0, 15), **HAT},
        (ABS_X, ABS_Y), ABS_Z, 0x134, 0x135, 0x132, (ABS_RX, ABS_RY)),
    "Sony DualShock 4, hid-sony and hid-playstation": RecordedPad(
        (0x130, 0x131, 0x133, 0x134, *range(0x136, 0x13F)),
        {**sticks(127, 129, 128, 127, 0, 255), **TRIGGERS, **HAT}, *AS_XPAD),
}
