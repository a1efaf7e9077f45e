"""Hours of messages through the whole server in minutes, on a clock that skips every wait: memory stays flat."""

import asyncio
import contextlib
import gc
import json
import os
import selectors
import time
from types import SimpleNamespace

import pytest
from tornado.httpclient import HTTPRequest
from tornado.ioloop import IOLoop
from tornado.websocket import websocket_connect
from web_client import SPEEDS, NotedRobot

from robotont_teleop.hand.speeds import STOP
from robotont_teleop.web import page_socket, web_server
from robotont_teleop.web.access import Access
from robotont_teleop.web.driving_seat import DrivingSeat
from robotont_teleop.web.web_server import STATE_RATE, WebServer

pytestmark = pytest.mark.long
HOURS = 8
COMMAND_PERIOD = 0.04  # [s] of the page while its sticks are held
GROWTH = 500_000       # [bytes] of resident memory in the second half; a byte per message would be a million


def test_hours_of_driving_through_the_whole_server_take_no_memory(monkeypatch):
    clock = SkippingSelector()
    monkeypatch.setattr(IOLoop, "time", lambda _: clock.now)
    for module in (web_server, page_socket):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock.now))
    loop = asyncio.SelectorEventLoop(clock)
    loop.time = lambda: clock.now
    with contextlib.closing(loop):
        loop.run_until_complete(drive(clock))


async def drive(clock):
    """One page drives for 50 s of each minute, another one watches."""
    robot, newest, states, sizes, sent = CountingRobot(), {}, [0, 0], [], 0
    server = WebServer(robot, DrivingSeat(SPEEDS, 0.2, 0.3), Access(None))
    server.listen("127.0.0.1", 0)

    def take(page, text):
        states[page] += '"kind": "state"' in text[:20]
        newest.update({"time": json.loads(text)["time"]} if page == 0 and '"kind": "state"' in text[:20] else {})
    request = HTTPRequest(f"ws://127.0.0.1:{server.port}/socket", headers={"Origin": f"http://127.0.0.1:{server.port}"})
    pages = [await websocket_connect(request, on_message_callback=lambda text, page=page: take(page, text))
             for page in range(2)]
    while not all(states):
        await asyncio.sleep(COMMAND_PERIOD)
    clock.skips, begun, start = True, time.monotonic(), clock.now
    for hour in range(1, HOURS + 1):
        while clock.now < start + 3600.0 * hour:
            for command in range(1251):
                speed = 0.001 * (1 + command % 300) if command < 1250 else 0
                pages[0].write_message(json.dumps({"kind": "drive", **newest, "x": speed, "y": 0, "turn": 0}))
                if command % 25 == 0:
                    pages[0].write_message(json.dumps({"kind": "ping", **newest}))
                await asyncio.sleep(COMMAND_PERIOD)
            sent += 1251
            await asyncio.sleep(10.0)
        gc.collect()
        with open("/proc/self/statm") as file:
            sizes.append(int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
        print(f"hour {hour}: {robot.commands} commands, {states[1]} states to each page, {sizes[-1] / 1e6:.2f} MB, "
              f"{time.monotonic() - begun:.0f} s", flush=True)
    assert (robot.newest, robot.commands) == (STOP, sent)
    assert (server.refused, server.seat.dropped, server.seat.timeouts, len(server.pages)) == (0, 0, 0, 2)
    assert min(states) > 0.99 * 3600.0 * HOURS * STATE_RATE
    assert sizes[-1] - sizes[HOURS // 2 - 1] < GROWTH, sizes
    await server.close()


class SkippingSelector(selectors.DefaultSelector):
    """The clock of an event loop, too; once it `skips`, nothing is waited for: the time is that of the next timer."""

    def __init__(self):
        super().__init__()
        self.now = 1000.0  # [s]
        self.skips = False

    def select(self, timeout=None):
        """What is ready now."""
        events = super().select(0 if self.skips else timeout)
        if timeout and not events:
            self.now += timeout
        return events


class CountingRobot(NotedRobot):
    """Counts commands and keeps the newest only; moves, and has a new status with every twentieth state."""

    commands, newest, states = 0, None, 0

    def send(self, twist):
        self.commands, self.newest = self.commands + 1, twist

    def state(self):
        self.states += 1
        return {**super().state(), "pose": [0.001 * self.states, -0.1, 0.2], "velocity": self.newest}

    def status(self):
        light = {"name": "driver_node: command stream", "level": 0, "words": f"second {self.states // 20}"}
        return {**super().status(), "lights": [light]}
