"""The server against browsers that mean well and others: who comes in, what moves the robot."""

import asyncio
import contextlib
import json
import socket
import time

import pytest
from tornado.httpclient import HTTPClientError
from tornado.websocket import WebSocketClosedError
from web_client import PATIENCE, Served

from robotont_teleop.page_socket import MESSAGES_PER_SECOND, WRONG_MESSAGES
from robotont_teleop.speeds import STOP
from robotont_testing.harness import wait_for

TOKEN = "the-token-of-this-test"
FORM = {"Content_Type": "application/x-www-form-urlencoded"}


@pytest.fixture
def served():
    """A server for tests of what is done, not of when: on a busy machine, too, nothing is too late for it."""
    with Served(oldest=PATIENCE, dead_man=PATIENCE) as server:
        yield server


@pytest.fixture
def timely():
    """As it is delivered."""
    with Served() as server:
        yield server


@pytest.fixture
def guarded():
    with Served(TOKEN) as server:
        yield server


def ready(served, **who):
    page = served.page(**who)
    wait_for(lambda: {"hello", "state", "status"} <= set(page.messages), "the first messages")
    return page


@pytest.mark.timed
def test_a_page_drives_and_its_silence_stops(timely):
    page = ready(timely)
    page.drive(0.3, 0.1, -1.0)
    wait_for(lambda: timely.robot.sent, "the command")
    start = time.monotonic()
    wait_for(lambda: timely.robot.sent[-1] == STOP, "the stop")
    assert time.monotonic() - start < 0.35
    assert timely.robot.sent == [(0.3, 0.1, -1.0), STOP]
    page.drive(0.3)
    wait_for(lambda: page.messages["state"]["hands_off"], "the state")
    assert timely.robot.sent[-1] == STOP


def test_a_page_that_closes_stops(served):
    page = ready(served)
    page.drive(0.3)
    wait_for(lambda: served.robot.sent, "the command")
    page.close()
    wait_for(lambda: served.robot.sent[-1] == STOP, "the stop")
    assert served.server.seat.timeouts == 0


def test_old_commands_are_dropped(timely):
    page = ready(timely)
    page.drive(0.3, time=page.time - 250)
    page.drive(0.3, time=page.time + 60000)
    wait_for(lambda: timely.server.seat.dropped == 2, "the commands")
    assert not timely.robot.sent


def test_one_drives_and_the_others_watch(served):
    one, two = ready(served), ready(served)
    one.drive(0.3)
    wait_for(lambda: served.robot.sent, "the command")
    two.drive(-0.3)
    two.order("reset_odometry")
    wait_for(lambda: "refused" in two.messages, "the refusal")
    assert (-0.3, 0.0, 0.0) not in served.robot.sent
    two.order("take")
    wait_for(lambda: one.messages["state"]["driver"] == two.messages["hello"]["page"], "the new driver")
    two.drive(-0.3)
    two.drive(0.0)
    two.drive(-0.2)
    wait_for(lambda: (-0.2, 0.0, 0.0) in served.robot.sent, "the command after letting go")
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP, STOP, (-0.2, 0.0, 0.0)]


def test_everybody_may_stop_but_only_the_driver_releases(served):
    one, two = ready(served), ready(served)
    one.drive(0.3)
    two.send({"kind": "stop"})
    wait_for(lambda: ("cancel",) in served.robot.orders, "the stop")
    assert served.robot.orders == [("press",), ("cancel",)]
    wait_for(lambda: one.messages["state"]["stopped"] and two.messages["state"]["stopped"], "the state")
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP]
    two.order("release")
    wait_for(lambda: "refused" in two.messages, "the refusal")
    one.order("release")
    wait_for(lambda: ("release",) in served.robot.orders, "the release")


def test_a_release_that_has_not_seen_the_newest_stop_releases_nothing(served):
    one, two = ready(served), ready(served)
    one.send({"kind": "stop"})
    wait_for(lambda: one.messages["state"]["stopped"], "the state")
    seen = one.time
    two.send({"kind": "stop"})
    wait_for(lambda: served.robot.orders.count(("press",)) == 2, "the second stop")
    one.order("release", time=seen)
    wait_for(lambda: "late" in one.messages, "the refusal")
    assert served.robot.stopped
    wait_for(lambda: one.time > 1000.0 * served.robot.pressed_at, "the state")
    one.order("release")
    wait_for(lambda: not served.robot.stopped, "the release")


@pytest.mark.parametrize("kind, fields", [("release", {}), ("goal", {"x": 1.0, "y": 0.0}), ("give_back", {}),
                                          ("take", {}), ("reset_odometry", {})])
def test_old_orders_are_dropped_and_their_page_gets_to_know(timely, kind, fields):
    page = ready(timely)
    page.order(kind, time=page.time - 250, **fields)
    wait_for(lambda: page.messages.get("late", {}).get("what") == kind, "words")
    assert not timely.robot.orders
    assert timely.server.seat.driver is None


def test_a_stop_and_a_cancel_hold_however_late(served):
    page = ready(served)
    page.send({"kind": "cancel"}, {"kind": "stop"})
    wait_for(lambda: served.robot.orders == [("cancel",), ("press",), ("cancel",)], "both")


def test_whoever_holds_a_stick_while_another_drives_has_to_let_go_first(served):
    one, two = ready(served), ready(served)
    one.drive(0.3)
    wait_for(lambda: served.robot.sent, "the command")
    two.drive(-0.3)
    wait_for(lambda: served.server.seat.foreign == 1, "the command that is refused")
    one.close()
    wait_for(lambda: served.server.seat.driver is None, "the free seat")
    two.drive(-0.3)
    two.drive(0.0)
    two.drive(-0.2)
    wait_for(lambda: served.robot.sent[-1] == (-0.2, 0.0, 0.0), "the command after letting go")
    assert (-0.3, 0.0, 0.0) not in served.robot.sent


def test_a_stick_that_is_held_at_the_release_moves_nothing(served):
    page = ready(served)
    page.send({"kind": "stop"})
    wait_for(lambda: page.messages["state"]["stopped"], "the state")
    page.drive(0.3)
    wait_for(lambda: page.messages["state"]["hands_off"], "the state")
    page.order("release")
    page.drive(0.3)
    page.drive(0.0)
    page.drive(0.2)
    wait_for(lambda: served.robot.moved, "the command after letting go")
    assert (0.3, 0.0, 0.0) not in served.robot.sent


def test_the_end_of_the_server_is_a_zero_after_which_nothing_comes(served):
    page = ready(served)
    page.drive(0.3)
    wait_for(lambda: served.robot.moved, "the command")

    async def end():
        task = asyncio.ensure_future(served.server.close())
        command = {"kind": "drive", "time": page.time, "x": 0.3, "y": 0, "turn": 0}
        for _ in range(20):
            with contextlib.suppress(WebSocketClosedError):
                await page.socket.write_message(json.dumps(command))
            await asyncio.sleep(0.002)
        await task
    served.do(end())
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP]


def test_a_failure_of_the_feeding_loop_is_not_silent(served, monkeypatch):
    page = ready(served)
    monkeypatch.setattr(served.robot, "state", lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        served.do(served.server.ended())
    assert page.states


def test_orders(served):
    page = ready(served)
    page.order("goal", x=1.0, y=-2.5)
    page.send({"kind": "cancel"})
    page.order("give_back")
    page.order("reset_odometry")
    page.send({"kind": "ping", "time": 12.5})
    wait_for(lambda: "pong" in page.messages, "the answer")
    assert served.robot.orders == [("goal", 1.0, -2.5), ("cancel",), ("give_back",), ("reset_odometry",)]
    assert page.messages["pong"]["time"] == 12.5


def test_no_answer_is_lost_when_many_messages_come_at_once(served):
    page = ready(served)
    page.send(*[{"kind": "ping", "time": number} for number in range(20)], {"kind": "fly"})
    wait_for(lambda: "error" in page.messages, "the refusal of the last")
    assert page.messages["pong"]["time"] == 19


def is_closed(connection):
    """Whether the other end has closed it."""
    connection.setblocking(False)
    try:
        return connection.recv(1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


# Who comes in

def test_without_a_token_one_gets_the_login_page_only(guarded):
    status, _, body = guarded.request("GET", "/")
    assert (status, b'name="token"' in body, b'id="stop"' in body) == (401, True, False)
    for path in ("/map.png", "/camera.jpg"):
        assert guarded.request("GET", path)[0] == 401
    with pytest.raises(HTTPClientError) as refusal:
        guarded.page()
    assert refusal.value.code == 401


def test_wrong_tokens_and_too_many_of_them(guarded):
    origin = f"http://127.0.0.1:{guarded.port}"
    for _ in range(5):
        assert guarded.request("POST", "/login", "token=wrong", Origin=origin, **FORM)[0] == 401
    assert guarded.request("POST", "/login", "token=" + TOKEN, Origin=origin, **FORM)[0] == 429


def test_the_token_gives_a_cookie_that_opens(guarded):
    origin = f"http://127.0.0.1:{guarded.port}"
    status, headers, _ = guarded.request("POST", "/login", "token=" + TOKEN, Origin=origin, **FORM)
    cookie = headers["Set-Cookie"]
    assert status == 303
    assert all(word in cookie for word in ("HttpOnly", "SameSite=Strict", "Path=/"))
    assert TOKEN not in str(headers)
    value = cookie.partition(";")[0].partition("=")[2]
    assert b'id="stop"' in guarded.request("GET", "/", Cookie="robotont_teleop=" + value)[2]
    assert ready(guarded, cookie=value)
    with pytest.raises(HTTPClientError) as refusal:
        guarded.page(cookie=value[:-1] + "x")
    assert refusal.value.code == 401


def test_a_token_in_the_address_opens_nothing(guarded):
    assert guarded.request("GET", "/?token=" + TOKEN)[0] == 401


def test_foreign_origins(served, guarded):
    for origin in (None, "null", "http://evil.example", f"https://127.0.0.1:{served.port}", "http://127.0.0.1:1"):
        with pytest.raises(HTTPClientError) as refusal:
            served.page(origin=origin)
        assert refusal.value.code == 403
    assert guarded.request("POST", "/login", "token=" + TOKEN, Origin="http://evil.example", **FORM)[0] == 403
    assert guarded.request("POST", "/login", "token=" + TOKEN, **FORM)[0] == 403


def test_foreign_hosts(served):
    for host in ("evil.example", f"evil.example:{served.port}", "192.168.1.1", "localhost.evil.example"):
        assert served.request("GET", "/", Host=host)[0] == 403
        with pytest.raises(HTTPClientError) as refusal:
            served.page(host=host)
        assert refusal.value.code == 403
    for host in ("localhost", "robot.local:8100", "127.0.0.1"):
        assert served.request("GET", "/", Host=host)[0] == 200


def test_headers(served):
    _, headers, _ = served.request("GET", "/")
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'self';")
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "Server" not in headers


@pytest.mark.parametrize("path", ["/../setup.py", "/..%2fsetup.py", "/web/", "/app.py", "/%00", "//etc/passwd", "/test",
                                  "/" + "a" * 4000])
def test_no_other_files(served, path):
    assert served.request("GET", path)[0] == 404


def test_other_methods_and_large_requests(served):
    assert served.request("POST", "/", "x")[0] == 405
    assert served.request("DELETE", "/app.js")[0] == 405
    origin = f"http://127.0.0.1:{served.port}"
    try:
        status = served.request("POST", "/login", "token=" + "x" * 100_000, Origin=origin)[0]
    except OSError:
        status = 400  # closed before it had been sent
    assert status == 400
    assert served.request("GET", "/")[0] == 200


# What comes in

@pytest.mark.parametrize("text, code", [
    ("x" * 5000, 1009), (b"\xff\xfe", 1008), ("{", 1008), ("[" * 400, 1008), ('{"kind":"shutdown"}', 1008),
    ('{"kind":"drive","time":1,"x":NaN,"y":0,"turn":0}', 1008),
    ('{"kind":"drive","time":1,"x":1e999,"y":0,"turn":0}', 1008)])
def test_malformed_messages_move_nothing_and_end_the_page(served, text, code):
    page = ready(served)
    for _ in range(WRONG_MESSAGES):
        page.send(text)
    wait_for(lambda: page.closed, "the end")
    assert page.close_code in (code, None if code == 1009 else code)
    assert not served.robot.sent
    assert ready(served)


def test_a_message_with_nan_is_refused_with_words(served):
    page = ready(served)
    page.send(f'{{"kind":"drive","time":{page.time},"x":NaN,"y":0,"turn":0}}')
    wait_for(lambda: "error" in page.messages, "the refusal")
    assert "NaN" in page.messages["error"]["words"]
    assert not served.robot.sent


def test_a_thousand_messages_at_once_end_the_page_and_stop_the_robot(served):
    page = ready(served)
    page.drive(0.3)
    wait_for(lambda: served.robot.moved, "motion")
    start = time.monotonic()
    page.send(*[json.dumps({"kind": "drive", "time": page.time, "x": 0.3, "y": 0, "turn": 0})] * 1000)
    wait_for(lambda: page.closed, "the end")
    assert page.close_code == 1008
    assert served.robot.sent[-1] == STOP
    assert len(served.robot.sent) <= MESSAGES_PER_SECOND * (1 + time.monotonic() - start) + 10
    assert ready(served)


def test_two_hundred_connections(served):
    page = ready(served)
    sockets = [socket.create_connection(("127.0.0.1", served.port)) for _ in range(200)]
    wait_for(lambda: sum(map(is_closed, sockets)) >= 200 - 40, "the end of those beyond the limit")
    seen = page.states
    wait_for(lambda: page.states > seen + 3, "states for the page that is open")
    page.drive(0.2)
    wait_for(lambda: served.robot.moved, "its command")
    for connection in sockets:
        connection.close()
    wait_for(lambda: served.request("GET", "/app.js")[0] == 200, "an answer")


def test_too_many_pages(served):
    pages = [ready(served) for _ in range(8)]
    with pytest.raises(HTTPClientError) as refusal:
        served.page()
    assert refusal.value.code == 503
    pages[0].close()
    wait_for(lambda: len(served.server.pages) == 7, "the end of a page")
    assert ready(served)


def test_a_slow_reader_holds_up_nobody_and_is_closed(served, monkeypatch):
    monkeypatch.setattr("robotont_teleop.page_socket.SLOWEST_READER", 0.5)
    state = served.robot.state()
    monkeypatch.setattr(served.robot, "state", lambda: {**state, "board": "x" * 20000})
    good = ready(served)
    slow = socket.create_connection(("127.0.0.1", served.port))
    slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    host = f"127.0.0.1:{served.port}"
    slow.sendall((f"GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n"
                  "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").encode())
    wait_for(lambda: len(served.server.pages) == 2, "the second page")
    seen = good.states
    wait_for(lambda: len(served.server.pages) == 1, "the end of the slow page", timeout=6)  # before its pings run out
    assert good.states > seen + 5
    slow.close()


@pytest.mark.timed
def test_eight_viewers_at_20_hz_take_a_quarter_of_a_core_at_most(served):
    pages = [ready(served) for _ in range(8)]
    seen, before, start = pages[0].states, time.process_time(), time.monotonic()
    wait_for(lambda: pages[0].states >= seen + 100, "states", period=0.1)
    share = (time.process_time() - before) / (time.monotonic() - start)
    print(f"server and its eight clients in one process: {100 * share:.0f} % of a core")
    assert share < 0.25


def test_eight_viewers_get_the_state_at_its_rate(served):
    pages = [ready(served) for _ in range(8)]
    before = [page.states for page in pages]
    start = time.monotonic()
    wait_for(lambda: pages[0].states >= before[0] + 20, "states")
    elapsed = time.monotonic() - start
    for page, count in zip(pages, before):
        assert page.states - count >= 15
    assert elapsed > 0.8
