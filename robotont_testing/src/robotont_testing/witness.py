"""Notices when the machine itself stands still, as virtual ones do while their host serves others."""

import os
import threading
import time

PERIOD = 0.005  # [s]
PRIORITY = 50   # of 99 in real time


class Witness:
    """A thread that wakes every PERIOD, before all other processes; for a `with` block.

    What it was late by, every process on the machine was late by: a delay measured in that time is none of theirs.
    Where real-time priority is not allowed it notices nothing: it would take a busy machine for one that stands still.
    """

    def __init__(self):
        self._gaps = []  # (begin, end) [s] on the monotonic clock between two wakes more than twice PERIOD apart
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()

    def longest_gap(self, begin, end):
        """[s] that the thread could not run at a stretch between these times on the monotonic clock."""
        time.sleep(2 * PERIOD)  # until a gap that has just ended is noted
        return max((min(end, after) - max(begin, before) for before, after in list(self._gaps)
                    if before < end and after > begin), default=0.0)

    def _run(self):
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))  # of this thread
        except OSError:
            return
        woken = time.monotonic()
        while not self._ended.wait(PERIOD):
            now = time.monotonic()
            if now - woken > 2 * PERIOD:
                self._gaps.append((woken, now))
            woken = now
