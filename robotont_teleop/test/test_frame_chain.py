"""The chain of frames from the map to the robot, and to its sensors."""

import pytest
from geometry_msgs.msg import Quaternion

from robotont_teleop.web.frame_chain import FrameChain
from robotont_testing.bus import transform


def test_the_chain_holds_the_robots_frames_only_without_the_namespace():
    base, chain = "robot1/base_link", FrameChain("robot1/")
    chain.hear([transform("robot1/base_link", "robot1/wheel", 9.0), transform("map", "robot1/odom", 1.0)], 0.0)
    assert chain.pose(base, 0.0) == ("", None)
    chain.hear([transform("robot1/base_footprint", "robot1/base_link", 0.1)], 0.0, fixed=True)
    chain.hear([transform("robot1/odom", "robot1/base_footprint", 2.0)], 0.0)
    assert chain.pose(base, 0.5) == ("map", pytest.approx((3.1, 0.0, 0.0)))
    chain.hear([transform("robot1/base_link", "laser", 0.2)], 0.0, fixed=True)
    assert chain.pose("laser", 0.5, base) == ("base_link", pytest.approx((0.2, 0.0, 0.0)))
    hanging = transform("laser", "camera", 0.0, 0.3)
    hanging.transform.rotation = Quaternion(1.0, 0.0, 0.0, 0.0)
    chain.hear([hanging, transform("camera", "lens", 0.1, 0.05)], 0.0, fixed=True)
    assert chain.pose("lens", 0.5, base) == ("base_link", pytest.approx((0.3, 0.25, 0.0)))  # its left is the right
    assert chain.pose(base, 1.5) == ("", None)  # the odometry is silent
    chain.hear([transform("robot1/odom", "robot1/base_footprint", 3.0)], 2.0)
    assert chain.pose(base, 2.5) == ("map", pytest.approx((4.1, 0.0, 0.0)))  # a place on the map holds on
