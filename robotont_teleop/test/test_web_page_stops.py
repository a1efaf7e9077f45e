"""The page in a real browser, on a server as it is delivered: whatever happens to it, it stops the robot in time.

And it orders nothing that is old. What the robot makes of an order is tested with the node.
"""

import itertools
import json
import time

import numpy as np
import pytest
from page_client import drives, open_page

from robotont_teleop.hand.speeds import STOP
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import wait_for
from robotont_testing.stalling_proxy import StallingProxy

pytestmark = [pytest.mark.timed, pytest.mark.skipif(CHROMIUM is None, reason="no chromium")]
LOG = """window.sent = []; // [when it was sent [ms], message, x of the newest movement then]
window.moves = []; // [when the page heard of it [ms], x] of each movement of a pointer
const now = () => performance.timeOrigin + performance.now();
for (const kind of ['pointerrawupdate', 'pointermove']) {
  window.addEventListener(kind, (event) => window.moves.push([now(), event.clientX]), true);
}
window.WebSocket = class extends WebSocket {
  send(text) {
    window.sent.push([now(), text, window.moves.at(-1)?.[1]]);
    super.send(text);
  }
};"""
STOPS_IN = 0.4    # [s]
REST = 0.3        # [s] in which nothing moves it again
OLDEST = 0.2      # [s]
STALL = 1.5       # [s]


def log_orders(server):
    """Write down (time [s], twist) of each; returns the server."""
    server.log, send = [], server.robot.send
    server.robot.send = lambda twist: (server.log.append((time.time(), twist)), send(twist))
    return server


@pytest.fixture
def logged(timely):
    return log_orders(timely)


def drive_on(page, server, right=0.3, up=0.9, turn=0.6):
    """Both thumbs on the sticks until it drives; taken anew when the page wants it or has let go.

    A page lets go when it loses the focus, as a new tab may while an old one still closes.
    """
    def moves():
        held = page.run("document.querySelector('.held') !== null")
        if page.touched and (not held or "Let go of" in page.text("#can")):
            page.lift()
        if not page.touched:
            page.push(1, "#move", right, up)
            page.push(2, "#turn", turn)
        return drives(server)
    wait_for(moves, "motion", period=0.05)


def stops_after(server, act, what):
    """Carry out `act`: within STOPS_IN a zero goes out, and it is the last."""
    seen, start = len(server.log), time.time()
    act()
    stood = wait_for(lambda: next((at for at, twist in server.log[seen:] if twist == STOP), None), what) - start
    assert stood < STOPS_IN, what
    time.sleep(REST)
    assert not [twist for at, twist in server.log[seen:] if at > start + stood and twist != STOP], what
    print(f"a zero {stood:.2f} s after {what}", flush=True)


def test_both_sticks_at_once_drive_and_letting_go_stops(browser, logged):
    page = open_page(browser, logged, size=PHONE)
    drive_on(page, logged, 0.6, 0.6, -0.7)
    wait_for(lambda: all(side * part > 0.1 for side, part in zip((1, -1, 1), logged.robot.sent[-1])), "both")
    stops_after(logged, page.lift, "letting go")
    assert page.complaints() == []
    page.close()


def test_whatever_happens_to_the_page_the_robot_stops(browser, logged):
    proxy = StallingProxy(logged.port)

    def hide(page):
        open_page(browser, logged).call("Page.bringToFront")
        page.wait("document.hidden", "the hidden page")
    for what, act in (("hiding", hide),
                      ("freezing", lambda page: page.call("Page.setWebLifecycleState", state="frozen")),
                      ("a cut connection", lambda page: proxy.cut())):
        page = open_page(browser, proxy, size=PHONE)
        drive_on(page, logged)
        stops_after(logged, lambda act=act, page=page: act(page), what)
        page.close()
    with Browser() as other:
        drive_on(open_page(other, logged, size=PHONE), logged)
        stops_after(logged, other.kill, "killing the browser")
    proxy.close()


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_stalled_connection_stops_and_delivers_nothing_old(browser, logged, direction):
    proxy = StallingProxy(logged.port)
    page = open_page(browser, proxy, size=PHONE, script=LOG)
    drive_on(page, logged)
    stops_after(logged, lambda: proxy.stall(direction), f"a stall {direction}")
    end, positions, seen = time.monotonic() + STALL, itertools.cycle((0.1, 0.2, 0.3, 0.4)), len(logged.log)
    while time.monotonic() < end:  # the thumb goes on, so that every command is another one
        page.push(1, "#move", next(positions), 0.5)
    proxy.flow()
    page.wait("$('can').textContent.includes('Let go of')", "the request to let go")
    assert not [twist for _, twist in logged.log[seen:] if twist != STOP], "sticks were not let go"
    page.lift()
    page.wait("$('app').dataset.live === 'true'", "the end of that request")
    drive_on(page, logged)
    stops_after(logged, page.lift, "letting go")
    sent = [(at / 1000.0, values) for at, values, _ in commands_of(page)]
    for received, twist in logged.log:
        if twist != STOP:
            ages = [received - at for at, values in sent if at <= received + 0.005 and alike(values, twist)]
            assert ages, f"a command that the page never sent: {twist}"
            assert min(ages) <= OLDEST
    page.close()
    proxy.close()


def commands_of(page):
    """[(when [ms], twist, x of the newest movement)] of all commands that a page has sent."""
    return [(at, tuple(json.loads(text)[part] for part in ("x", "y", "turn")), x)
            for at, text, x in page.run("window.sent") if '"drive"' in text]


def alike(one, other):
    return all(abs(part - another) < 1e-6 for part, another in zip(one, other))


OURS, TAIL = 8.0, 40.0  # [ms] that the page and its server may take, of half the movements and of 99 %
MOVES, MOVE_PERIOD = 150, 0.02  # [s] movements of a stick whose way is measured
HALF_A_STEP = 0.2  # [px] of these movements


@pytest.mark.long
@pytest.mark.parametrize("pointer", ["mouse", "finger"])
def test_the_delay_from_a_movement_of_a_pointer_to_its_order(browser, served, pointer):
    """From when the browser tells the page of it, when nothing else runs."""
    page = open_page(browser, log_orders(served), script=LOG)
    if pointer == "finger":
        page.take_mouse_for_finger()
    x, y = page.place("#move")

    def moves():
        if "Let go of" in page.text("#can"):
            page.lift()
        if not page.touched:
            page.mouse_at(x, y)
        page.mouse_at(x + 5.0, y - 60.0)
        return drives(served)
    wait_for(moves, "motion", period=0.05)
    first = x + 10.0
    for step in range(MOVES):
        page.mouse_at(first + step * 2 * HALF_A_STEP, y - 60.0)
        time.sleep(MOVE_PERIOD)
    page.lift()
    wait_for(lambda: not drives(served), "the stop")
    orders = [(x, next((at for at, twist in served.log if 1000.0 * at >= sent - 1.0 and alike(values, twist)), None))
              for sent, values, x in commands_of(page) if x is not None]
    orders = [(x, 1000.0 * at) for x, at in orders if at is not None]  # None: dropped for a newer one
    moved = {x: at for at, x in reversed(page.run("window.moves")) if first <= x <= orders[-1][0]}  # the first of each
    delays = [next(at for x, at in orders if x >= place - HALF_A_STEP) - start for place, start in moved.items()]
    p50, p99 = np.percentile(delays, (50, 99))
    print(f"{pointer}: p50 {p50:.1f} ms, p99 {p99:.1f} ms of {len(delays)} movements", flush=True)
    assert len(delays) > MOVES / 2
    assert p50 < OURS
    assert p99 < TAIL
    page.close()
