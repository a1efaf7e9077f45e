"""Interprets the events of a gamepad, by named layouts; free of ROS, device and clock.

Codes are those of Linux' input-event-codes.h, which evdev names in the same way.
"""

from typing import NamedTuple, Tuple

from robotont_teleop.speeds import STOP, without_dead_zone

EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
SYN_REPORT, SYN_DROPPED = 0, 3
ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_GAS, ABS_BRAKE = 0, 1, 2, 3, 4, 5, 9, 10
BTN_TRIGGER, BTN_THUMB2, BTN_TOP2, BTN_PINKIE, BTN_BASE4 = 0x120, 0x122, 0x124, 0x125, 0x129
BTN_EAST, BTN_C, BTN_WEST, BTN_Z = 0x131, 0x132, 0x134, 0x135
BTN_TL, BTN_TR, BTN_TR2, BTN_START = 0x136, 0x137, 0x139, 0x13B


class Layout(NamedTuple):
    """Codes of the axes and buttons that matter. An axis is larger downwards and to the right."""

    move_x: int    # left stick, right
    move_y: int    # left stick, down
    turn: int      # right stick, right
    dead_man: int  # drives only while it is held
    fast: int      # held as well: full speed
    stop: int      # emergency stop
    release: int   # releases it
    triggers: Tuple[int, ...] = ()  # axes that tell the layout from others, though nothing is driven by them

    @property
    def axes(self):
        """Codes of the axes of a pad with this layout."""
        return {self.move_x, self.move_y, self.turn, *self.triggers}

    @property
    def buttons(self):
        """Codes of the buttons of a pad with this layout."""
        return {self.dead_man, self.fast, self.stop, self.release}


LAYOUTS = {
    # PlayStation pads without a driver of their own (hid-generic, as DualSense in kernels before 5.12). First, because
    # their triggers are where the other pads have the right stick, and rest at its rim.
    "playstation_generic": Layout(ABS_X, ABS_Y, ABS_Z, BTN_WEST, BTN_Z, BTN_C, BTN_TR2, (ABS_RX, ABS_RY, ABS_RZ)),
    "xbox": Layout(ABS_X, ABS_Y, ABS_RX, BTN_TL, BTN_TR, BTN_EAST, BTN_START),         # kernel driver xpad
    "playstation": Layout(ABS_X, ABS_Y, ABS_RX, BTN_TL, BTN_TR, BTN_EAST, BTN_START),  # hid-playstation, hid-sony
    # Xbox pads by Bluetooth and those made for Android, without a driver of their own
    "bluetooth": Layout(ABS_X, ABS_Y, ABS_Z, BTN_TL, BTN_TR, BTN_EAST, BTN_START, (ABS_GAS, ABS_BRAKE)),
    "directinput": Layout(ABS_X, ABS_Y, ABS_Z, BTN_TOP2, BTN_PINKIE, BTN_THUMB2, BTN_BASE4),  # e.g. Logitech in mode D
}


def layout_for(codes):
    """Name of the first layout whose axes and buttons are all among the `codes` {EV_KEY: set, EV_ABS: set}, or None."""
    return next((name for name, layout in LAYOUTS.items()
                 if layout.axes <= codes.get(EV_ABS, set()) and layout.buttons <= codes.get(EV_KEY, set())), None)


class Gamepad:
    """The state of one gamepad. `ranges`: (lowest, highest) by code of an axis."""

    def __init__(self, layout, ranges, slow, fast, dead_zone):
        self._layout = layout
        self._ranges = ranges
        self._slow, self._fast = slow, fast  # Speeds without and with the fast button
        self._dead_zone = dead_zone
        self._values = {}
        self._centred = False  # whether the sticks have been in the middle since the dead-man button went down

    def event(self, kind, code, value):
        """Take an event; "stop" or "release" when it is that of the emergency stop's buttons, else None.

        The release needs the dead-man button as well, so that no bump of a single button releases.
        """
        if kind not in (EV_KEY, EV_ABS):
            return None
        self._values[kind, code] = value
        layout = self._layout
        if kind == EV_KEY and value == 1:
            if code == layout.stop:
                return "stop"
            if code == layout.release and self._held(layout.dead_man):
                return "release"
        if not self._held(layout.dead_man):
            self._centred = False
        elif self._position() == STOP:
            self._centred = True
        return None

    def replace(self, axes, keys):
        """Take the whole state of the device, {code: value} of its axes and the codes of its pressed keys.

        For the start, and after lost events; "stop" when the emergency stop's button is down, else None. What happened
        meanwhile is unknown, so the sticks have to be in the middle once before they move anything.
        """
        self._values = {**{(EV_ABS, code): value for code, value in axes.items()},
                        **{(EV_KEY, code): 1 for code in keys}}
        self.let_go()
        return "stop" if self._held(self._layout.stop) else None

    def let_go(self):
        """From now on the sticks move nothing until they have been in the middle."""
        self._centred = self._held(self._layout.dead_man) and self._position() == STOP

    @property
    def twist(self):
        """(v_x [m/s], v_y [m/s], omega [rad/s]); zero without the dead-man button.

        A stick that is already deflected when the button goes down moves nothing until it has been let go once.
        """
        if not self._held(self._layout.dead_man) or not self._centred:
            return STOP
        speeds = self._fast if self._held(self._layout.fast) else self._slow
        return speeds.twist(*self._position())

    def _held(self, button):
        return bool(self._values.get((EV_KEY, button)))

    def _position(self):
        layout = self._layout
        right, down = without_dead_zone(self._axis(layout.move_x), self._axis(layout.move_y), self._dead_zone)
        turn, _ = without_dead_zone(self._axis(layout.turn), 0.0, self._dead_zone)
        return (0.0 - down, 0.0 - right, 0.0 - turn)

    def _axis(self, code):
        lowest, highest = self._ranges[code]
        value = self._values.get((EV_ABS, code))
        if value is None or highest <= lowest:
            return 0.0
        return 2.0 * (value - lowest) / (highest - lowest) - 1.0
