"""Waiting for conditions."""

import time


def wait_for(condition, what, timeout=20.0, period=0.005):
    """Until `condition()` is true; AssertionError that names `what` after `timeout` [s]."""
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, f"waited {timeout} s in vain for {what}"
        time.sleep(period)
