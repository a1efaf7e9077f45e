"""A day of messages, and the processor that eight open pages cost; run by `./robotont test -m long robotont_teleop`."""

import json
import os
import time
import tracemalloc

import pytest
from web_client import Served

from robotont_teleop.driving_seat import DrivingSeat
from robotont_teleop.messages import read_message
from robotont_teleop.speeds import Speeds
from robotont_testing.harness import wait_for

pytestmark = pytest.mark.long
DAY = 24 * 3600 * 25   # commands of a page that is driven for a day
MEMORY = 100_000       # [bytes] that a day may add
CORE = 0.25            # of one core for eight pages at 20 Hz


def test_a_day_of_commands_takes_no_memory():
    seat = DrivingSeat(Speeds(0.5, 2.0), oldest=0.2, dead_man=0.25)
    tracemalloc.start()
    for number in range(DAY):
        now = number * 0.04
        text = f'{{"kind":"drive","time":{1000 * now:.1f},"x":{0.001 * (1 + number % 300)},"y":0,"turn":0}}'
        message = read_message(text)
        seat.command(1, message.time / 1000.0, message.values, now)
        if number == 1000:
            before = tracemalloc.get_traced_memory()[0]
    assert tracemalloc.get_traced_memory()[0] - before < MEMORY
    assert (seat.dropped, seat.foreign) == (0, 0)


def test_messages_through_the_whole_server_take_no_memory():
    with Served() as served:
        served.robot.sent = _Forgetful()
        page = served.page()
        wait_for(lambda: "state" in page.messages, "the first state")
        sizes = []
        for _ in range(12):
            for _ in range(10):
                page.send(*[json.dumps({"kind": "ping", "time": number}) for number in range(90)])
                time.sleep(1.0)  # within the rate that a page may have
            sizes.append(_resident())
        assert not page.closed
        assert max(sizes[6:]) - sizes[5] < 2_000_000, sizes


def test_eight_pages_at_20_hz():
    with Served(max_pages=8) as served:
        pages = [served.page() for _ in range(8)]
        wait_for(lambda: all(page.states for page in pages), "states")
        before, start = time.process_time(), time.monotonic()
        seen = pages[0].states
        wait_for(lambda: pages[0].states >= seen + 200, "states", period=0.1)
        share = (time.process_time() - before) / (time.monotonic() - start)
        print(f"server and eight clients in one process: {100 * share:.0f} % of a core")
        assert share < CORE


class _Forgetful(list):
    def append(self, _):
        pass


def _resident():
    with open(f"/proc/{os.getpid()}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


