"""Signals that come while a node starts."""

import os
import signal
import time

import pytest

from robotont_driver.ros.lifecycle import signals_wait
from robotont_driver.rospy_repairs import rospy_process


@pytest.fixture
def done(monkeypatch):
    """What has happened, in this order; a SIGTERM is noted; "limit": its end may not take long now."""
    happened = []
    monkeypatch.setattr(rospy_process, "end_soon", lambda: happened.append("limit"))
    before = signal.signal(signal.SIGTERM, lambda *_: happened.append("signal"))
    yield happened
    signal.signal(signal.SIGTERM, before)


def test_a_signal_waits_for_the_end_of_the_start(done):
    with signals_wait():
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.01)
        done.append("start")
    time.sleep(0.01)
    assert done == ["limit", "start", "signal"]
