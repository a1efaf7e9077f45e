"""The page in a real browser, on a server as it is delivered: whatever happens to it, it stops the robot in time.

And it orders nothing that is old. What the robot makes of an order is tested with the node.
"""

import time

import pytest
from page_client import drives, open_page

from robotont_teleop.hand.speeds import STOP
from robotont_testing.browser import CHROMIUM, PHONE, Browser
from robotont_testing.harness import wait_for
from robotont_testing.stalling_proxy import StallingProxy

pytestmark = [pytest.mark.timed, pytest.mark.skipif(CHROMIUM is None, reason="no chromium")]
STOPS_IN = 0.4    # [s]
REST = 0.3        # [s] in which nothing moves it again
STALL = 1.5       # [s]


@pytest.fixture
def logged(timely):
    """Writes down (time [s], twist) of each order."""
    timely.log, send = [], timely.robot.send
    timely.robot.send = lambda twist: (timely.log.append((time.time(), twist)), send(twist))
    return timely


def drive_on(page, server, right=0.3, up=0.9, turn=0.6, moves=drives):
    """Both thumbs on the sticks until it `moves(server)`; taken anew when the page wants it or has let go of one.

    A page lets go when it loses the focus, as a new tab may while an old one still closes, and when it stalls.
    """
    def moves_now():
        if page.touched and page.run("!document.querySelectorAll('.held')[1] || $('can').dataset.key === 'can_let_go'"):
            page.lift()
        if not page.touched:
            page.push(1, "#move", right, up)
            page.push(2, "#turn", turn)
        return moves(server)
    wait_for(moves_now, "motion", period=0.05)


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
    drive_on(page, logged, 0.6, 0.6, -0.7, lambda server: all(
        side * part > 0.1 for side, part in zip((1, -1, 1), [STOP, *server.robot.sent][-1])))
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
    page = open_page(browser, proxy, size=PHONE)
    drive_on(page, logged)
    stops_after(logged, lambda: proxy.stall(direction), f"a stall {direction}")
    seen = len(logged.log)
    page.push(1, "#move", 0.4, 0.5)  # the thumb goes on
    time.sleep(STALL)
    proxy.flow()
    page.wait("$('can').textContent.includes('Let go of')", "the request to let go")
    assert not [twist for _, twist in logged.log[seen:] if twist != STOP], "sticks were not let go"
    page.lift()
    page.wait("$('app').dataset.live === 'true'", "the end of that request")
    drive_on(page, logged)
    stops_after(logged, page.lift, "letting go")
    page.close()
    proxy.close()
