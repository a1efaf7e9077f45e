import threading
from types import SimpleNamespace

import rospy

from robotont_driver.nodes.odom_node import OdomNode
from robotont_driver.odometry.odometry_stamps import OdometryStamps
from robotont_driver.ros.diagnostics import OK, WARN


def test_simulated_time_that_nobody_publishes_is_told(monkeypatch):
    node = OdomNode.__new__(OdomNode)
    node._lock, node._clock, node._odometry = threading.Lock(), OdometryStamps(0.02), SimpleNamespace(period=0.02)
    for now, level in ((0.0, WARN), (100.0, OK)):
        monkeypatch.setattr(rospy, "get_time", lambda now=now: now)
        assert node._report_stamps()[0] == level
