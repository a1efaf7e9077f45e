#!/usr/bin/env python3
"""gamepad_teleop on events as the kernel writes them, through a pipe that stands in for the device file.

/dev/uinput is not there in most containers; evdev's own reader and event format are used all the same.
"""

import contextlib
import os
import struct
import time
from types import SimpleNamespace

import rospy
import rostest
from evdev import AbsInfo, InputEvent
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

from robotont_driver.parameters import read_parameters
from robotont_teleop.gamepad import ABS_RX, ABS_X, ABS_Y, BTN_EAST, BTN_START, BTN_TL, BTN_TR, EV_ABS, EV_KEY
from robotont_teleop.gamepad_teleop import PARAMETERS, GamepadTeleop
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

STOP = (0.0, 0.0, 0.0)
EVENT = struct.Struct("llHHi")  # struct input_event: seconds, microseconds, type, code, value
PATH = "/dev/input/event99"


class PipedPad:
    """Devices as evdev shows them: one pad while it is plugged in."""

    def __init__(self):
        self.plugged = False
        self._write = None

    def plug(self):
        self.plugged = True

    def unplug(self):
        self.plugged = False
        os.close(self._write)

    def event(self, kind, code, value):
        now = time.time()
        os.write(self._write, EVENT.pack(int(now), 0, kind, code, value) + EVENT.pack(int(now), 0, 0, 0, 0))

    # what evdev has

    def list_devices(self):
        return [PATH] if self.plugged else []

    def InputDevice(self, path):
        assert path == PATH
        read, self._write = os.pipe()
        axis = AbsInfo(value=0, min=-32768, max=32767, fuzz=16, flat=128, resolution=0)
        return SimpleNamespace(
            name="recorded pad", active_keys=lambda: [], close=lambda: os.close(read),
            capabilities=lambda: {EV_KEY: [BTN_TL, BTN_TR, BTN_EAST, BTN_START],
                                  EV_ABS: [(ABS_X, axis), (ABS_Y, axis), (ABS_RX, axis)]},
            read_loop=lambda: self._events(read))

    @staticmethod
    def _events(read):
        while True:
            data = os.read(read, EVENT.size)
            if not data:
                raise OSError(19, "No such device")  # ENODEV, as the kernel says when it is unplugged
            yield InputEvent(*EVENT.unpack(data))


class GamepadTeleopTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.pad = PipedPad()
        cls.teleop = GamepadTeleop(read_parameters(PARAMETERS, {"retry_period": 0.05}), cls.pad)

    def setUp(self):
        super().setUp()
        self.commands = []
        self.listen("cmd_vel", Twist, lambda message: self.commands.append(
            (message.linear.x, message.linear.y, message.angular.z)))
        self.plug()
        self.addCleanup(self.unplug)

    def plug(self):
        self.pad.plug()
        name = rospy.get_name().lstrip("/")
        self.wait_for_status(f"{name}: gamepad", OK, "recorded pad")

    def unplug(self):
        with contextlib.suppress(OSError):
            self.pad.unplug()
        self.status.clear()
        self.wait_for_status(f"{rospy.get_name().lstrip('/')}: gamepad", WARN, "no gamepad found")

    def newest_is(self, twist, what):
        wait_for(lambda: self.commands and all(abs(one - other) < 1e-3 for one, other in
                                               zip(self.commands[-1], twist)), what)

    def test_the_dead_man_button_and_both_sticks(self):
        self.pad.event(EV_KEY, BTN_TL, 1)
        self.pad.event(EV_ABS, ABS_X, 32767)
        self.pad.event(EV_ABS, ABS_RX, -32768)
        self.newest_is((0.0, -0.3, 1.0), "strafing right and turning left")
        seen = len(self.commands)
        wait_for(lambda: len(self.commands) > seen + 10, "the command again, though nothing has changed")
        self.pad.event(EV_KEY, BTN_TR, 1)
        self.newest_is((0.0, -0.8, 2.0), "faster")
        self.pad.event(EV_KEY, BTN_TL, 0)
        self.newest_is(STOP, "the stop")

    def test_unplugging_stops_and_plugging_in_does_not_drive(self):
        self.pad.event(EV_KEY, BTN_TL, 1)
        self.pad.event(EV_ABS, ABS_Y, -32768)
        self.newest_is((0.3, 0.0, 0.0), "motion")
        self.unplug()
        self.newest_is(STOP, "the stop")
        self.plug()
        seen = len(self.commands)
        self.pad.event(EV_ABS, ABS_Y, -32768)
        self.pad.event(EV_KEY, BTN_TL, 1)
        self.pad.event(EV_ABS, ABS_Y, 0)
        self.pad.event(EV_ABS, ABS_Y, 32767)
        self.newest_is((-0.3, 0.0, 0.0), "motion after letting go once")
        self.assertNotIn((0.3, 0.0, 0.0), self.commands[seen:])

    def test_emergency_stop(self):
        stops = self.listen("emergency_stop", Bool)
        self.pad.event(EV_KEY, BTN_EAST, 1)
        wait_for(lambda: stops and stops[-1].data, "the emergency stop")
        self.pad.event(EV_KEY, BTN_START, 1)
        wait_for(lambda: not stops[-1].data, "the release")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "gamepad_teleop_test", GamepadTeleopTest)
