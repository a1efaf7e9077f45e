#!/usr/bin/env python3
"""gamepad_teleop on a recorded pad: a pipe with the kernel's event format, read by evdev's own reader.

Groups of events end with a report, SYN_DROPPED comes when events were lost, ENODEV when it is unplugged.
"""

import os
import struct

import rospy
import rostest
from evdev import ecodes
from evdev.eventio import EventIO
from geometry_msgs.msg import Twist
from recorded_pads import PADS
from std_msgs.msg import String

from robotont_driver.parameters.parameters import read_parameters
from robotont_teleop.hand.gamepad_teleop import PARAMETERS, GamepadTeleop
from robotont_testing.harness import wait_for
from robotont_testing.node_test import OK, WARN, NodeTest

STOP = (0.0, 0.0, 0.0)
EVENT = struct.Struct("llHHi")  # struct input_event: seconds, microseconds, type, code, value
PATH = "/dev/input/event99"
NAME = "pad of this test"
XBOX = PADS["Microsoft X-Box 360 pad, xpad"]


class RecordedDevice(EventIO):
    """What evdev.InputDevice is of a real one: its events come through a pipe, its state from `pad`."""

    name = NAME

    def __init__(self, pad, fd):
        self._pad = pad
        self.fd = fd
        os.set_blocking(fd, False)

    def read(self):
        """As the kernel's: ENODEV when it is unplugged."""
        events = tuple(super().read())
        if not events:
            raise OSError(19, "No such device")
        return iter(events)

    def capabilities(self):
        return XBOX.capabilities

    def absinfo(self, code):
        return XBOX.axes[code]._replace(value=self._pad.axes[code])

    def active_keys(self):
        return sorted(self._pad.keys)

    def close(self):
        os.close(self.fd)


class RecordedPad:
    """Devices as evdev shows them: one pad while it is plugged in."""

    def __init__(self):
        self.axes, self.keys = {}, set()
        self._write = None

    def plug(self):
        self.axes, self.keys = {code: info.value for code, info in XBOX.axes.items()}, set()
        self._read, self._write = os.pipe()

    def unplug(self):
        if self._write is not None:
            os.close(self._write)
            self._write = None

    def frame(self, *events):
        """A group of events, and the report that ends it."""
        self.lose(*events)
        self.put(*events, (ecodes.EV_SYN, ecodes.SYN_REPORT, 0))

    def lose(self, *events):
        """Events that the device's buffer has no room for; its state changes all the same."""
        for kind, code, value in events:
            if kind == ecodes.EV_ABS:
                self.axes[code] = value
            else:
                (self.keys.add if value else self.keys.discard)(code)

    def put(self, *events):
        os.write(self._write, b"".join(EVENT.pack(0, 0, *event) for event in events))

    # what evdev has

    def list_devices(self):
        return [PATH] if self._write is not None else []

    def InputDevice(self, path):
        assert path == PATH
        return RecordedDevice(self, os.dup(self._read))


class GamepadTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rospy.set_param("~diagnostic_period", 0.1)
        cls.task = rospy.get_name().lstrip("/") + ": gamepad"
        cls.pad = RecordedPad()
        cls.teleop = GamepadTeleop(read_parameters(PARAMETERS, {}), cls.pad)

    def setUp(self):
        super().setUp()
        self.commands = []
        self.listen("cmd_vel", Twist, lambda message: self.commands.append(
            (message.linear.x, message.linear.y, message.angular.z)))
        self.plug()
        self.addCleanup(self.unplug)

    def plug(self):
        self.pad.plug()
        self.wait_for_status(self.task, OK, NAME)

    def unplug(self):
        self.pad.unplug()
        self.status.clear()
        self.wait_for_status(self.task, WARN, "no gamepad found")

    def drive_ahead(self):
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TL, 1))
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, -32768))
        self.newest_is((0.3, 0.0, 0.0), "motion")

    def let_go_once_and_drive_back(self):
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, 0))
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, 32767))
        self.newest_is((-0.3, 0.0, 0.0), "motion after letting go once")

    def newest_is(self, twist, what):
        wait_for(lambda: self.commands and all(abs(one - other) < 1e-3 for one, other in
                                               zip(self.commands[-1], twist)), what)

    def test_the_dead_man_button_and_both_sticks(self):
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TL, 1))
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_X, 32767), (ecodes.EV_ABS, ecodes.ABS_RX, -32768))
        self.newest_is((0.0, -0.3, 1.0), "strafing right and turning left")
        self.assertFalse([one for one in self.commands if abs(one[1] + 0.3 * one[2]) > 1e-3], "half of a group")
        seen = len(self.commands)
        wait_for(lambda: len(self.commands) > seen + 10, "the command again, though nothing has changed")
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TR, 1))
        self.newest_is((0.0, -0.8, 2.0), "faster")
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TL, 0))
        self.newest_is(STOP, "the stop")

    def test_unplugging_stops_and_plugging_in_does_not_drive(self):
        self.drive_ahead()
        self.unplug()
        self.newest_is(STOP, "the stop")
        self.plug()
        seen = len(self.commands)
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, -32768))
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TL, 1))
        self.let_go_once_and_drive_back()
        self.assertNotIn((0.3, 0.0, 0.0), self.commands[seen:])

    def test_the_emergency_stop_and_its_release_which_moves_nothing(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        self.drive_ahead()
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_EAST, 1))
        wait_for(lambda: stops and stops[-1].data, "the emergency stop")
        self.newest_is(STOP, "the stop")
        seen = len(self.commands)
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_START, 1))
        wait_for(lambda: not stops[-1].data, "the release")
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, -30000))
        self.let_go_once_and_drive_back()
        self.assertFalse([one for one in self.commands[seen:] if one[0] > 1e-3])

    def test_a_dead_man_button_that_is_let_go_of_unseen_stops(self):
        self.drive_ahead()
        self.pad.lose((ecodes.EV_KEY, ecodes.BTN_TL, 0))
        self.pad.put((ecodes.EV_SYN, ecodes.SYN_DROPPED, 0), (ecodes.EV_ABS, ecodes.ABS_X, 32767))
        self.newest_is(STOP, "the stop at the loss, before the next report")
        seen = len(self.commands)
        self.pad.frame()
        wait_for(lambda: self.values(self.task)["times that events were lost"] == "1", "a look at the pad's state")
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, -30000))
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TR, 1))
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_Y, 0))
        self.pad.frame((ecodes.EV_KEY, ecodes.BTN_TL, 1))
        self.pad.frame((ecodes.EV_ABS, ecodes.ABS_X, -32768))
        self.newest_is((0.0, 0.8, 0.0), "motion by the state after the loss")
        self.assertFalse([one for one in self.commands[seen:] if abs(one[0]) > 1e-3])


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "gamepad_teleop_test", GamepadTest)
