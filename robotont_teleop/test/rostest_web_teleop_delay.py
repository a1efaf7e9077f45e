#!/usr/bin/env python3
"""Delays from the movement of a pointer on the page, in a real browser, to the command on cmd_vel."""

import json
import math
import time

import numpy as np
import rostest
from web_pages import PagesTest

from robotont_testing.browser import DESKTOP
from robotont_testing.harness import wait_for

MOVES, MOVE_PERIOD = 150, 0.02  # [s] movements of a stick whose way to cmd_vel is measured
HALF_A_STEP = 0.1  # [px] of these movements
PARTS = ("from the test to the event", "to its handler", "to the command's sending", "to cmd_vel/hand", "to cmd_vel")


class DelayTest(PagesTest):
    """How long it takes from a movement to the command: of this machine, when nothing else runs on it."""

    def test_from_stick_to_cmd_vel(self):
        for pointer in ("mouse", "finger"):
            parts = np.array(self.delays_from_stick_to_cmd_vel(pointer))  # one row per movement
            total = parts.sum(axis=1)
            for part, delays in (*zip(PARTS, parts.T), ("all", total)):
                p50, p99 = np.percentile(delays, (50, 99))
                print(f"{pointer}: {part}: p50 {p50:.1f} ms, p99 {p99:.1f} ms", flush=True)
            self.assertLess(np.percentile(total, 50), 10.0, pointer)
            self.assertLess(np.percentile(total, 99), 40.0, pointer)

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
        wait_for(lambda: page.run("window.moves.at(-1)?.[0]") >= x - HALF_A_STEP or page.mouse_at(x, y),
                 "the last movement", period=MOVE_PERIOD)  # of two at once the browser drops one
        return moved

    def delays_from_stick_to_cmd_vel(self, pointer):
        """[ms] from each movement of a stick until a command with it, or with a later one, is on cmd_vel, by PARTS.

        pointer: "mouse" or "finger".
        """
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
        events = page.run("window.moves")
        sent = [(x, at, json.loads(text)) for at, text, x in page.run("window.sent") if '"drive"' in text]
        ways = [(x, at, arrival(self.hand, at, message), arrival(self.commands, at, message))
                for x, at, message in sent if x is not None]
        ways = [way for way in ways if None not in way]
        self.close(page)
        farthest = max((x for x, *_ in ways), default=-math.inf)
        self.assertGreaterEqual(farthest, max(moved) - HALF_A_STEP, "the last movements never became a command")
        delays = []
        for place, start in moved.items():
            _, stamped, handled = next(event for event in events if event[0] >= place - HALF_A_STEP)
            _, *times = next(way for way in ways if way[0] >= place - HALF_A_STEP)
            times = (1000.0 * start, stamped, handled, *times)
            delays.append([after - before for before, after in zip(times, times[1:])])
        return delays


def arrival(commands, sent, message):
    """[ms] when a page's message, sent at `sent` [ms], came among the commands; None: dropped for a newer one."""
    wanted = (message["x"], message["y"], message["turn"])
    return next((1000.0 * at for at, command in commands if 1000.0 * at >= sent - 1.0
                 and all(abs(one - other) < 1e-6 for one, other in zip(wanted, command))), None)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_delay_test", DelayTest)
