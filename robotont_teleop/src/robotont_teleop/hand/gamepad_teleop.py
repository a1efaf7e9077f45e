"""Drives the robot by a gamepad on Linux' event devices."""

import threading

import evdev
import rospy
from evdev import ecodes

from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_driver.ros.worker import Worker
from robotont_teleop.hand.gamepad import LAYOUTS, Gamepad, layout_for
from robotont_teleop.hand.hand_output import HandOutput
from robotont_teleop.hand.speeds import STOP, Speeds

PARAMETERS = (
    Parameter("device", "auto", "such as /dev/input/event7; auto: the first that is a gamepad"),
    Parameter("layout", "auto", "where sticks and buttons are", choices=("auto", *LAYOUTS)),
    Parameter("linear_speed", 0.3, "of the left stick at its rim", "m/s", minimum=0.01, maximum=100.0),
    Parameter("angular_speed", 1.0, "of the right stick at its rim", "rad/s", minimum=0.01, maximum=100.0),
    Parameter("fast_linear_speed", 0.8, "with the fast button", "m/s", minimum=0.01, maximum=100.0),
    Parameter("fast_angular_speed", 2.0, "with the fast button", "rad/s", minimum=0.01, maximum=100.0),
    Parameter("dead_zone", 0.12, "part of a stick's way that counts as its middle", minimum=0.0, maximum=0.9),
)

PUBLISH_PERIOD = 0.05  # [s] between commands while the robot is driven
RETRY_PERIOD = 0.5     # [s] between two looks for the gamepad


class GamepadTeleop:
    """Opens the gamepad whenever it is there; drives while its dead-man button is held."""

    def __init__(self, parameters, devices=evdev):
        self._parameters = parameters
        self._devices = devices  # list_devices() and InputDevice(path), as evdev has them
        self._output = HandOutput()
        self._lock = threading.Lock()
        self._pad = None
        self._dropped = False  # events have been lost, and no report has come since
        self._losses = 0       # times that this has happened
        self._name, self._trouble = "", "looking for a gamepad"
        self._last_logged = None
        rospy.on_shutdown(self._let_go)
        Worker(self._repeat)
        Worker(self._read)
        Health(robot_name(), {"gamepad": self._report})

    def _read(self):
        """Take a gamepad's events until it is unplugged; returns the time to rest before the next look for one."""
        device = None
        try:
            device, layout = self._find()
            if device is None:
                self._say(self._trouble)
            else:
                self._take_events(device, layout)
        except OSError as error:
            self._trouble = f"gamepad {self._name}: {error.strerror or error}"
            self._say(self._trouble)
        finally:
            self._let_go()
            if device is not None:
                device.close()
        return RETRY_PERIOD

    def _find(self):
        """(device, name of its layout), or (None, None) with the reason in `_trouble`. Raises OSError."""
        wanted, named = self._parameters["device"], self._parameters["layout"]
        self._trouble = "no gamepad found: plug one in; is this user in group input?"
        for path in self._devices.list_devices() if wanted == "auto" else [wanted]:
            device = self._devices.InputDevice(path)
            layout = layout_for(device.capabilities())
            if layout and named != "auto":
                layout = named
            if layout:
                return device, layout
            device.close()
            if wanted != "auto":
                self._trouble = f"{wanted} has not the sticks and buttons of any layout: {', '.join(LAYOUTS)}"
        return None, None

    def _take_events(self, device, layout):
        given = self._parameters
        axes = dict(device.capabilities().get(ecodes.EV_ABS, ()))
        slow = Speeds(given["linear_speed"], given["angular_speed"])
        fast = Speeds(given["fast_linear_speed"], given["fast_angular_speed"])
        pad = Gamepad(LAYOUTS[layout], {code: (info.min, info.max) for code, info in axes.items()}, slow, fast,
                      min(0.9, given["dead_zone"]))
        self._name, self._trouble = device.name, ""
        self._say(f"{device.name}, layout {layout}: hold the left shoulder button to drive, the right one as well for "
                  "more speed")
        with self._lock:
            self._pad = pad
            self._take_state(device)
        self._dropped = False
        for event in device.read_loop():
            with self._lock:
                self._take_event(device, event)

    def _take_event(self, device, event):
        """Events count from the report that ends their group, so that both axes of a stick change at once.

        When the kernel's buffer has overflowed, SYN_DROPPED comes; the events up to the next report are then remains of
        a group, and the device itself is asked for its state.
        """
        if event.type == ecodes.EV_SYN and event.code == ecodes.SYN_DROPPED:
            self._dropped = True
            self._pad.let_go()
            self._output.send(STOP)
        elif event.type == ecodes.EV_SYN and event.code == ecodes.SYN_REPORT:
            if self._dropped:
                self._take_state(device)
                self._dropped = False
                self._losses += 1
            self._send()
        elif not self._dropped:
            self._press_or_release(self._pad.event(event.type, event.code, event.value))

    def _take_state(self, device):
        axes = {code: device.absinfo(code).value for code, _ in device.capabilities().get(ecodes.EV_ABS, ())}
        self._press_or_release(self._pad.replace(axes, device.active_keys()))

    def _press_or_release(self, order):
        if order == "stop":
            self._output.press_emergency_stop()
        elif order == "release":
            self._output.emergency_stop.release()
            self._pad.let_go()

    def _send(self):
        """The command of now: at once when it changes."""
        if self._output.emergency_stop.pressed:
            self._pad.let_go()
        twist = self._pad.twist
        if twist != self._output.sent:
            self._output.send(twist)

    def _repeat(self):
        """Send the newest command again while it is not zero; a stick that is held still has no events."""
        with self._lock:
            if self._pad and self._output.emergency_stop.pressed:
                self._send()
            if self._output.sent != STOP:
                self._output.send(self._output.sent)
        return PUBLISH_PERIOD

    def _let_go(self):
        with self._lock:
            self._pad = None
            if self._output.sent != STOP:
                self._output.send(STOP)

    def _say(self, words):
        if words != self._last_logged:
            self._last_logged = words
            rospy.loginfo("%s", words)

    def _report(self):
        with self._lock:
            values = {"gamepad": self._name or "none yet", "sent": self._output.sent,
                      "listeners": self._output.listeners, "times that events were lost": self._losses}
            plugged = self._pad is not None
        return (OK, self._name, values) if plugged else (WARN, self._trouble, values)


def main():
    """Run gamepad_teleop."""
    run_without_wheels("gamepad_teleop", GamepadTeleop, PARAMETERS)
