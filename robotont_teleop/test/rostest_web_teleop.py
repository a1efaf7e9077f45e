#!/usr/bin/env python3
"""The page in a real browser, with the whole stack on the simulator behind it: what the fingers do, the robot does."""

import itertools
import json
import time

import rostest
from web_pages import PagesTest, rim_speed

from robotont_testing.browser import DESKTOP, Browser
from robotont_testing.harness import wait_for

STANDS = 0.02     # [m/s] slower than this is standing
STOPS_IN = 0.5    # [s]
REST = 0.3        # [s] in which a robot that would swing back does
OLDEST = 0.2      # [s]
STALL = 1.5       # [s]


class WebTeleopTest(PagesTest):
    def stops_after(self, act, what):
        """Carry out `act`; the robot must stand within STOPS_IN from then on, and swing a little at most."""
        seen, start = len(self.truth), time.monotonic()
        act()
        stood = wait_for(lambda: next((at for at, twist in self.truth[seen:] if rim_speed(twist) < STANDS), None),
                         f"the stop after {what}", timeout=5) - start
        self.assertLess(stood, STOPS_IN, what)
        wait_for(lambda: self.truth[-1][0] > start + stood + REST, "the truth")
        self.assertLess(max(rim_speed(twist) for at, twist in self.truth[seen:] if at > start + stood), 2 * STANDS,
                        f"moves again after {what}")
        print(f"stands {stood:.2f} s after {what}", flush=True)

    def drive_on(self, page, right=0.3, up=0.9, turn=0.6, until=None):
        """Both thumbs on the sticks until it drives, or `until`; taken anew when the page wants it or has let go.

        A page lets go when it loses the focus, as a new tab may while an old one still closes.
        """
        def drives():
            held = page.run("document.querySelector('.held') !== null")
            if page.touched and (not held or "Let go of" in page.text("#can")):
                page.lift()
            if not page.touched:
                page.push(1, "#move", right, up)
                page.push(2, "#turn", turn)
            return until() if until else self.speed() > 0.1
        wait_for(drives, "motion", period=0.05)

    def hide(self, page):
        self.open(size=DESKTOP).call("Page.bringToFront")
        page.wait("document.hidden", "the hidden page")

    def test_both_sticks_at_once_move_the_robot_as_commanded_and_stop_is_quick(self):
        page = self.open()
        page.key("Digit3", down=True)

        def as_commanded():
            wanted, real = self.commands[-1][1], self.truth[-1][1]
            return wanted[0] > 0.1 and wanted[1] < -0.1 and wanted[2] > 0.3 and all(
                abs(one - other) < 0.03 + 0.1 * abs(other) for one, other in zip(real, wanted))
        self.drive_on(page, 0.6, 0.6, -0.7, until=as_commanded)
        self.assertEqual(page.text("#driver"), "You drive")
        self.stops_after(page.lift, "letting go")
        self.assertEqual(page.complaints(), [])

    def test_whatever_happens_to_the_page_the_robot_stops(self):
        for what, act in (
                ("hiding", self.hide),
                ("freezing", lambda page: page.call("Page.setWebLifecycleState", state="frozen")),
                ("a cut connection", lambda page: self.proxy.cut())):
            page = self.open()
            self.drive_on(page)
            self.stops_after(lambda act=act, page=page: act(page), what)
            self.close(page)
        with Browser() as browser:
            page = self.open(browser=browser)
            self.pages.remove(page)
            self.drive_on(page)
            self.stops_after(browser.kill, "killing the browser")

    def test_a_stalled_connection_stops_and_delivers_nothing_old(self):
        for direction in ("up", "down"):
            page = self.open()
            self.drive_on(page)
            self.stops_after(lambda direction=direction: self.proxy.stall(direction), f"a stall {direction}")
            end = time.monotonic() + STALL
            positions = itertools.cycle((0.1, 0.2, 0.3, 0.4))
            while time.monotonic() < end:  # the thumb goes on, so that every command is another one
                page.push(1, "#move", next(positions), 0.5)
                self.assertLess(self.speed(), 2 * STANDS)  # it may still swing a little
            seen = len(self.hand)
            self.proxy.flow()
            page.wait("$('can').textContent.includes('Let go of')", "the request to let go")
            self.assertFalse([command for _, command in self.hand[seen:] if any(command)], "sticks were not let go")
            page.lift()
            page.wait("$('app').dataset.live === 'true'", "the end of that request")
            self.drive_on(page)
            self.stops_after(page.lift, "letting go")
            self.assert_none_is_old(page)
            self.close(page)

    def assert_none_is_old(self, page):
        """Every command that reached the mux had left the page at most OLDEST before."""
        sent = [(at / 1000.0, json.loads(text)) for at, text, _ in page.run("window.sent")]
        drives = [(at, (message["x"], message["y"], message["turn"])) for at, message in sent
                  if message["kind"] == "drive"]
        start = drives[0][0]
        for received, command in self.hand:
            if received >= start and any(command):
                ages = [received - at for at, values in drives if at <= received + 0.005 and
                        all(abs(one - other) < 1e-6 for one, other in zip(values, command))]
                self.assertTrue(ages, f"a command that the page never sent: {command}")
                self.assertLessEqual(min(ages), OLDEST)


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_test", WebTeleopTest)
