"""A day of messages through the whole server in minutes, on a clock that skips every wait: memory stays flat."""

import asyncio
import contextlib
import gc
import os
import selectors
import time
from types import SimpleNamespace

import pytest
from tornado.ioloop import IOLoop
from web_client import SETTINGS, WEB, NotedRobot

from robotont_teleop import page_socket, web_server
from robotont_teleop.access import Access
from robotont_teleop.speeds import STOP
from robotont_teleop.web_server import WebServer

pytestmark = pytest.mark.long
DAY = 24 * 3600.0      # [s]
COMMAND_PERIOD = 0.04  # [s] of the page while its sticks are held
COMMANDS_PER_PING = 25
DRIVE = 50.0           # [s] of every minute; then the sticks are let go of
PARTS = 24             # after each of which the memory is looked at
TEXT, PING, PONG, MASKED, LONG = 0x81, 0x89, 0x8A, 0x80, 126  # first two bytes of a frame
STATE = b'{"kind": "state", "time": '
GROWTH = 500_000       # [bytes] of resident memory in the day's second half; a byte per message would be 2.9 million


def test_a_day_of_driving_through_the_whole_server_takes_no_memory(monkeypatch):
    clock = SkippingSelector()
    monkeypatch.setattr(IOLoop, "time", lambda _: clock.now)
    for module in (web_server, page_socket):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock.now))
    loop = asyncio.SelectorEventLoop(clock)
    loop.time = lambda: clock.now
    with contextlib.closing(loop):
        loop.run_until_complete(drive_for_a_day(clock, loop))


async def drive_for_a_day(clock, loop):
    """One page drives, another one watches."""
    robot = CountingRobot()
    server = WebServer(robot, Access(None), SETTINGS, WEB)
    port = server.listen("127.0.0.1", 0)
    driver, viewer = [(await loop.create_connection(lambda: LightPage(port), "127.0.0.1", port))[1]
                      for _ in range(2)]
    while not (driver.states and viewer.states):
        await asyncio.sleep(COMMAND_PERIOD)
    clock.skips = True
    sizes, sent, begun, start = [], 0, time.monotonic(), clock.now
    for part in range(1, PARTS + 1):
        while clock.now < start + part * DAY / PARTS:
            sent += await hold_the_sticks(driver, DRIVE)
            await asyncio.sleep(60.0 - DRIVE)
        gc.collect()
        sizes.append(resident())
        print(f"hour {part * DAY / PARTS / 3600.0:g}: {robot.commands} commands, {viewer.states} states to each page, "
              f"{sizes[-1] / 1e6:.2f} MB, {time.monotonic() - begun:.0f} s", flush=True)
    assert (robot.newest, robot.commands) == (STOP, sent)
    assert (server.refused, server.seat.dropped, server.seat.timeouts) == (0, 0, 0)
    assert (driver.closed, viewer.closed) == (False, False)
    assert min(driver.states, viewer.states) > 0.99 * DAY * SETTINGS.rate
    assert sizes[-1] - sizes[PARTS // 2 - 1] < GROWTH, sizes
    await server.close()


async def hold_the_sticks(page, duration):
    """Commands, and pings among them, for so long [s]; then that of hands that are off. Returns how many commands."""
    number = round(duration / COMMAND_PERIOD)
    for command in range(number):
        page.send(b'{"kind": "drive", "time": %b, "x": %.3f, "y": 0.1, "turn": -0.2}' %
                  (page.time, 0.001 * (1 + command % 300)))
        if command % COMMANDS_PER_PING == 0:
            page.send(b'{"kind": "ping", "time": %b}' % page.time)
        await asyncio.sleep(COMMAND_PERIOD)
    page.send(b'{"kind": "drive", "time": %b, "x": 0, "y": 0, "turn": 0}' % page.time)
    return number + 1


class LightPage(asyncio.Protocol):
    """What a page is to the server, at little cost: a WebSocket (RFC 6455) for short messages."""

    def __init__(self, port):
        self._port = port
        self._received = None  # the bytes of no whole frame yet; None before the WebSocket is open
        self.time = b""        # [ms] newest server time, as it came
        self.states = 0
        self.closed = False

    def connection_made(self, transport):
        self._transport = transport
        transport.write(b"GET /socket HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nOrigin: http://127.0.0.1:%d\r\n"
                        b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n" % (self._port, self._port))

    def data_received(self, data):
        if self._received is None:
            head, _, data = data.partition(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 101"), head
            self._received = b""
        rest = self._received + data
        while len(rest) >= 4:
            begin, length = (4, int.from_bytes(rest[2:4], "big")) if rest[1] == LONG else (2, rest[1])
            if len(rest) < begin + length:
                break
            self._take(rest[0], rest[begin:begin + length])
            rest = rest[begin + length:]
        self._received = rest

    def _take(self, kind, content):
        if kind == PING:
            self._write(PONG, content)
        elif content.startswith(STATE):
            self.time = content[len(STATE):content.index(b",", len(STATE))]
            self.states += 1

    def send(self, text):
        self._write(TEXT, text)

    def _write(self, kind, content):
        assert len(content) < LONG
        self._transport.write(bytes((kind, MASKED + len(content), 0, 0, 0, 0)) + content)  # the mask of zeros

    def connection_lost(self, _error):
        self.closed = True


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

    def __init__(self):
        super().__init__()
        self.commands, self.newest = 0, None
        self._states = 0

    def send(self, twist):
        self.commands, self.newest = self.commands + 1, twist

    def state(self):
        self._states += 1
        return {**super().state(), "pose": [0.001 * self._states, -0.1, 0.2], "velocity": self.newest,
                "commanded": [0.1, 0.2, 0.3], "measured": [0.1, 0.2, 0.001 * (self._states % 7)]}

    def status(self):
        light = {"name": "driver_node: command stream", "level": 0, "words": f"second {self._states // 20}"}
        return {**super().status(), "lights": [light]}


def resident():
    """[bytes] of this process, server and clients."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
