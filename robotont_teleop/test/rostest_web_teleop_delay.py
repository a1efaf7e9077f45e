#!/usr/bin/env python3
"""Delays from the movement of a pointer on the page, in a real browser, to the command on cmd_vel.

They are those of the machine, on which the browser, the simulator and the stack run at once, and ours. So each drive
takes turns with the *floor*: an empty page that sends each movement as it comes, to a server that only writes it down.
"""

import json
import math
import time

import numpy as np
import rostest
import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket
from web_pages import LOG, PagesTest

from robotont_testing.browser import DESKTOP
from robotont_testing.harness import wait_for
from robotont_testing.loop_client import LoopClient

TURNS = 3  # of floor and page
OURS, TAIL = 8.0, 3.0  # [ms] that the page, its server and the mux may add to the floor, and times of its p99: five
# processes hand on a command, and each may have to wait for a core
ALIKE = 2e-4  # [m/s], [rad/s] by which the mux may change a command that is rounded to 1e-4: at `blind_speed` it does
MOVES, MOVE_PERIOD = 150, 0.02  # [s] movements of a stick whose way to cmd_vel is measured
HALF_A_STEP = 0.1  # [px] of these movements


class DelayTest(PagesTest):
    """How long it takes from a movement to the command: of this machine, when nothing else runs on it."""

    def test_from_stick_to_cmd_vel(self):
        with EmptyPage() as empty:
            for pointer in ("mouse", "finger"):
                floor, ours = [], []
                for _ in range(TURNS):
                    floor += self.delays_of_an_empty_page(pointer, empty)
                    ours += self.delays_from_stick_to_cmd_vel(pointer)
                (p50, p99), least = np.percentile(ours, (50, 99)), np.percentile(floor, (50, 99))
                print(f"{pointer}: p50 {p50:.1f} ms, p99 {p99:.1f} ms; floor {least[0]:.1f} ms, {least[1]:.1f} ms",
                      flush=True)
                self.assertLess(p50, least[0] + OURS, pointer)
                self.assertLess(p99, TAIL * least[1] + OURS, pointer)

    def move_pointer(self, page, begin, end):
        """Move the pointer in MOVES steps; {x [px]: when it was moved [s]}."""
        moved = {}
        for step in range(MOVES):
            part = step / MOVES
            x, y = (one + part * (other - one) for one, other in zip(begin, end))
            start = time.time()
            moved[x] = start
            page.mouse_at(x, y)
            time.sleep(max(0.0, MOVE_PERIOD - (time.time() - start)))
        wait_for(lambda: page.run(f"window.newest >= {x - HALF_A_STEP}") or page.mouse_at(x, y),
                 "the last movement", period=MOVE_PERIOD)  # of two at once the browser drops one
        return moved

    def delays_of_an_empty_page(self, pointer, empty):
        """[ms] from each movement until the server of an EmptyPage has heard of it, or of a later one."""
        page = self.browser.page(f"http://127.0.0.1:{empty.port}/", DESKTOP, script=LOG)
        self.pages.append(page)
        page.wait("document.title === 'open'", "the connection")
        if pointer == "finger":
            page.take_mouse_for_finger()
        page.mouse_at(90.0, 100.0)
        empty.heard.clear()
        moved = self.move_pointer(page, (100.0, 100.0), (160.0, 100.0))
        wait_for(lambda: empty.heard and empty.heard[-1][1] >= max(moved) - HALF_A_STEP, "the last movement")
        page.lift()
        self.close(page)
        return [1000.0 * (next(at for at, x in empty.heard if x >= place - HALF_A_STEP) - start)
                for place, start in moved.items()]

    def delays_from_stick_to_cmd_vel(self, pointer):
        """[ms] from each movement of a stick until a command with it, or with a later one, is on cmd_vel."""
        page = self.open(size=DESKTOP)
        if pointer == "finger":
            page.take_mouse_for_finger()

        x, y = page.place("#move")

        def drives():
            if "Let go of" in page.text("#can"):
                page.lift()
            if not page.touched:
                page.mouse_at(x, y)
            page.mouse_at(x + 5.0, y - 60.0)
            return self.speed() > 0.05
        wait_for(drives, "motion", period=0.05)
        moved = self.move_pointer(page, (x + 10.0, y - 60.0), (x + 70.0, y - 60.0))
        page.lift()
        wait_for(lambda: not any(self.commands[-1][1]), "the stop")
        ways = [(x, arrival(self.commands, at, json.loads(text))) for at, text, x in page.run("window.sent")
                if '"drive"' in text and x is not None]
        ways = [(x, came) for x, came in ways if came is not None]
        self.close(page)
        farthest = max((x for x, _ in ways), default=-math.inf)
        self.assertGreaterEqual(farthest, max(moved) - HALF_A_STEP, "the last movements never became a command")
        return [next(came for x, came in ways if x >= place - HALF_A_STEP) - 1000.0 * start
                for place, start in moved.items()]


class EmptyPage(LoopClient):
    """The page, and its server; heard: (when [s], x [px]) of each movement."""

    PAGE = """<!doctype html><body style="height: 100vh; touch-action: none"><script>
        const socket = new WebSocket(`ws://${location.host}/socket`);
        socket.onopen = () => (document.title = 'open');
        for (const kind of ['pointerrawupdate', 'pointermove']) {
          addEventListener(kind, (event) => socket.readyState === 1 && socket.send(event.clientX));
        }</script>"""

    def __enter__(self):
        super().__enter__()
        self.heard = []
        heard = self.heard

        class Page(tornado.web.RequestHandler):
            async def get(self):
                await self.finish(EmptyPage.PAGE)

        class Socket(tornado.websocket.WebSocketHandler):
            def on_message(self, x):
                heard.append((time.time(), float(x)))

        async def serve():
            sockets = tornado.netutil.bind_sockets(0, "127.0.0.1")
            server = tornado.httpserver.HTTPServer(tornado.web.Application([("/", Page), ("/socket", Socket)]))
            server.add_sockets(sockets)
            self.port = sockets[0].getsockname()[1]
        self.do(serve())
        return self


def arrival(commands, sent, message):
    """[ms] when a page's message, sent at `sent` [ms], came among the commands; None: dropped for a newer one."""
    wanted = (message["x"], message["y"], message["turn"])
    return next((1000.0 * at for at, command in commands if 1000.0 * at >= sent - 1.0
                 and all(abs(one - other) < ALIKE for one, other in zip(wanted, command))), None)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_delay_test", DelayTest)
