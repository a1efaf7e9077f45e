import os
import time

import pytest

from robotont_testing.harness import threads_take_turns
from robotont_testing.witness import Witness


def hold_up(seconds):
    """(begin, end) [s] of a time in which no other thread of this process runs."""
    time.sleep(0.05)
    with threads_take_turns(10.0):
        begin = time.monotonic()
        while time.monotonic() < begin + seconds:
            pass
    return begin, time.monotonic()


def real_time_is_allowed():
    """Whether this process may have real-time priority."""
    before = os.sched_getscheduler(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, before, os.sched_param(0))
    return True


@pytest.mark.skipif(not real_time_is_allowed(), reason="no real-time priority")
def test_what_holds_up_every_thread_is_noticed():
    with Witness() as witness:
        begin, end = hold_up(0.3)
        assert witness.longest_gap(begin, end) > 0.2
        assert witness.longest_gap(begin + 0.1, begin + 0.2) < 0.11, "only the part within these times"
        assert witness.longest_gap(begin - 20.0, begin - 10.0) == 0.0


def test_without_real_time_priority_it_notices_nothing(monkeypatch):
    def forbidden(*_):
        raise PermissionError
    monkeypatch.setattr(os, "sched_setscheduler", forbidden)
    with Witness() as witness:
        assert witness.longest_gap(*hold_up(0.3)) == 0.0
