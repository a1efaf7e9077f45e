#!/usr/bin/env python3
"""The topics whose messages are those of the official package robotont_msgs, with that package itself.

Skipped without it; conftest.py says where it is looked for.
"""

import unittest

import rostest
from rostest_official_boards import BoardTest

from robotont_testing.harness import wait_for

try:
    from robotont_msgs.msg import ColorRGB, LedModulePixel, LedModuleSegment, PowerSupply
except ImportError:
    PowerSupply = None


@unittest.skipIf(PowerSupply is None, "needs the official package robotont_msgs")
class RobotontMsgsTest(BoardTest):
    def test_lights_and_power_of_generation_2(self):
        self.start(f"_port:={self.port.link}")
        segment, pixel = self.publisher("led_segment", LedModuleSegment), self.publisher("led_pixel", LedModulePixel)
        wait_for(lambda: b"\x1b" in self.wire(), "the greeting")
        segment.publish(LedModuleSegment(idx_start=3, colors=[ColorRGB(255, 0, 1)] * 2))
        wait_for(lambda: b"LED:3:16711681:16711681\n" in self.wire(), "the line")
        pixel.publish(LedModulePixel(idx=7, color=ColorRGB(0, 0, 2)))
        wait_for(lambda: b"LED:7:2\n" in self.wire(), "the line of one light")
        supply = self.listen("power_supply", PowerSupply)
        self.say(b"POWER:1.5:14.8\r\n", until=lambda: supply)
        self.assertAlmostEqual(supply[0].voltage, 14.8, places=5)
        self.assertAlmostEqual(supply[0].current, 1.5, places=5)
        self.assertFalse(supply[0].estop_pressed)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "robotont_msgs_test", RobotontMsgsTest)
