"""Interprets the events of a gamepad, by named layouts; free of ROS, device and clock.

Codes are those of Linux' input-event-codes.h.
"""

from typing import NamedTuple, Tuple

from evdev import ecodes as e

from robotont_teleop.hand.speeds import STOP, without_dead_zone


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
    "playstation_generic": Layout(e.ABS_X, e.ABS_Y, e.ABS_Z, e.BTN_WEST, e.BTN_Z, e.BTN_C, e.BTN_TR2,
                                  (e.ABS_RX, e.ABS_RY, e.ABS_RZ)),
    # the kernel's drivers xpad, and hid-playstation or hid-sony
    "xbox": Layout(e.ABS_X, e.ABS_Y, e.ABS_RX, e.BTN_TL, e.BTN_TR, e.BTN_EAST, e.BTN_START),
    "playstation": Layout(e.ABS_X, e.ABS_Y, e.ABS_RX, e.BTN_TL, e.BTN_TR, e.BTN_EAST, e.BTN_START),
    # Xbox pads by Bluetooth and those made for Android, without a driver of their own
    "bluetooth": Layout(e.ABS_X, e.ABS_Y, e.ABS_Z, e.BTN_TL, e.BTN_TR, e.BTN_EAST, e.BTN_START,
                        (e.ABS_GAS, e.ABS_BRAKE)),
    # e.g. Logitech in mode D
    "directinput": Layout(e.ABS_X, e.ABS_Y, e.ABS_Z, e.BTN_TOP2, e.BTN_PINKIE, e.BTN_THUMB2, e.BTN_BASE4),
}


def layout_for(capabilities):
    """Name of the first layout whose axes and buttons a device with these `capabilities`, as of evdev, has; or None."""
    axes, buttons = {code for code, _ in capabilities.get(e.EV_ABS, ())}, set(capabilities.get(e.EV_KEY, ()))
    return next((name for name, layout in LAYOUTS.items() if layout.axes <= axes and layout.buttons <= buttons), None)


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
        if kind not in (e.EV_KEY, e.EV_ABS):
            return None
        self._values[kind, code] = value
        layout = self._layout
        if kind == e.EV_KEY and value == 1:
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
        self._values = {**{(e.EV_ABS, code): value for code, value in axes.items()},
                        **{(e.EV_KEY, code): 1 for code in keys}}
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
        return bool(self._values.get((e.EV_KEY, button)))

    def _position(self):
        layout = self._layout
        right, down = without_dead_zone(self._axis(layout.move_x), self._axis(layout.move_y), self._dead_zone)
        turn, _ = without_dead_zone(self._axis(layout.turn), 0.0, self._dead_zone)
        return (0.0 - down, 0.0 - right, 0.0 - turn)

    def _axis(self, code):
        lowest, highest = self._ranges[code]
        value = self._values.get((e.EV_ABS, code))
        if value is None or highest <= lowest:
            return 0.0
        return 2.0 * (value - lowest) / (highest - lowest) - 1.0
