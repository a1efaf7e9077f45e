"""A day of messages in a few minutes: memory stays flat."""

import json
import os
import time

import pytest
from web_client import Served

from robotont_teleop import page_socket
from robotont_teleop.speeds import STOP
from robotont_testing.harness import wait_for

pytestmark = pytest.mark.long
DAY = 24 * 3600 * 25   # commands of a page that is driven for a day
PARTS = 24             # after each of which the memory is looked at
BATCH = 500            # commands between two looks at whether the server has taken them
GROWTH = 1_000_000     # [bytes] of resident memory in the day's second half; one byte per message would be 1.1 million


def test_a_day_of_commands_through_the_whole_server_takes_no_memory(monkeypatch):
    monkeypatch.setattr(page_socket, "MESSAGES_PER_SECOND", 1e9)
    with Served(rate=200.0) as served:
        served.robot.sent = Newest()
        page, viewer = served.page(), served.page()
        wait_for(lambda: "state" in page.messages and "state" in viewer.messages, "the first states")
        seat, sizes, sent, start = served.server.seat, [], 0, time.monotonic()
        for _ in range(PARTS):
            for _ in range(DAY // PARTS // BATCH):
                page.send(*[json.dumps({"kind": "drive", "time": page.time, "x": 0.001 * (1 + number % 300), "y": 0,
                                        "turn": 0}) for number in range(BATCH - 1)],
                          {"kind": "drive", "time": page.time, "x": 0, "y": 0, "turn": 0})
                wait_for(lambda sent=sent: page.messages.get("pong", {}).get("time") == sent or
                         page.send({"kind": "ping", "time": sent}), "the commands")
                sent += BATCH
            sizes.append(resident())
            print(f"{sent} commands, {sizes[-1] / 1e6:.2f} MB", flush=True)
        print(f"{sent} commands and {page.states} states in {time.monotonic() - start:.0f} s, {seat.dropped} late; "
              f"grown by {(sizes[-1] - sizes[PARTS // 2 - 1]) / 1000:.0f} kB in the second half")
        assert sent >= DAY * 0.99
        assert not page.closed
        assert served.robot.sent.count > 0.9 * sent, "too few came in time to show anything"
        assert served.robot.sent.newest == STOP
        assert sizes[-1] - sizes[PARTS // 2 - 1] < GROWTH, sizes


class Newest:
    """Counts commands and keeps the newest only."""

    def __init__(self):
        self.count, self.newest = 0, None

    def append(self, twist):
        self.count, self.newest = self.count + 1, twist


def resident():
    """[bytes] of this process, server and clients."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
