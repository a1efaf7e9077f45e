"""Too much, too malformed or too slow: nothing moves, nobody else waits."""

import contextlib
import http.client
import socket
import struct
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from web_client import Client, Served

from robotont_teleop.hand.speeds import STOP
from robotont_teleop.web.page_server import MAX_CONNECTIONS
from robotont_testing.harness import wait_for


@pytest.mark.parametrize("text, code", [
    ("x" * 513, 1009), (b"\xff\xfe", 1008), ('{"kind":"' + "🤖" * 100 + '"}', 1008)])
def test_malformed_messages_end_the_page_and_stop_the_robot(served, text, code):
    page = served.ready_page()
    page.drive(0.3)
    wait_for(lambda: served.robot.sent, "motion")
    page.send(text)
    wait_for(lambda: page.closed, "the end")
    assert page.socket.close_code in (code, None if code == 1009 else code)
    assert served.robot.sent == [(0.3, 0.0, 0.0), STOP]
    assert served.ready_page()


def ask_for_socket(port):
    """A connection that asks to be a page's."""
    connection = socket.create_connection(("127.0.0.1", port))
    host = f"127.0.0.1:{port}"
    connection.sendall((f"GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n"
                        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").encode())
    return connection


def open_socket(port):
    """A connection that is a page's."""
    connection = ask_for_socket(port)
    assert connection.recv(1000).startswith(b"HTTP/1.1 101")
    return connection


def test_who_goes_before_the_answer_is_no_page(served, caplog):
    """Each such one counted as an open page for ever: behind 16 of them nobody could open one, nor press STOP."""
    for _ in range(100):
        with ask_for_socket(served.port) as gone:
            gone.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # as a reset ends it
    wait_for(lambda: not served.server.pages, "the end of all")
    assert served.ready_page()
    assert caplog.messages == []


def test_a_close_whose_reason_is_no_text_is_the_end_of_its_page(served):
    """It stayed an open page for ever, and the one that drives, if it was that."""
    with open_socket(served.port) as connection:
        connection.sendall(b"\x88\x83\0\0\0\0\x03\xe8\xff")
        wait_for(lambda: not served.server.pages, "the end")


def flood(connection, first, frame):
    """Send without an end, and faster than anybody reads; whether the server has closed it within 8 s."""
    end = time.monotonic() + 8.0
    try:
        connection.sendall(first)
        while time.monotonic() < end:
            connection.settimeout(max(0.001, end - time.monotonic()))
            connection.sendall(frame * 5000)
    except OSError as error:
        return not isinstance(error, socket.timeout)
    return False


MASKED = b"\x80\0\0\0\0"  # no payload; all that clients send is masked


@pytest.mark.parametrize("first, frame", [(b"", b"\x81\x85\0\0\0\0hello"), (b"\x01" + MASKED, b"\x00" + MASKED)],
                         ids=["texts", "parts of a message that does not end"])
def test_a_page_that_floods_holds_up_nobody_and_is_closed(served, first, frame):
    with Client(served.port) as other, ThreadPoolExecutor() as threads, open_socket(served.port) as connection:
        page = other.ready_page()
        page.drive(0.3)
        wait_for(lambda: served.robot.sent, "motion")
        seen, start = page.states, time.monotonic()
        closed = threads.submit(flood, connection, first, frame)
        wait_for(lambda: page.states >= seen + 10, "states during the flood", timeout=3)
        page.send({"kind": "stop"})
        wait_for(lambda: served.robot.stopped and served.robot.sent[-1] == STOP, "the stop", timeout=1)
        wait_for(lambda: page.states >= seen + 40, "states during the flood", timeout=5)
        assert time.monotonic() - start > 1.5, "states in a bundle"
        assert closed.result(), "it was not closed"
        wait_for(lambda: len(served.server.pages) == 1, "its end")


def test_a_stranger_who_holds_all_connections_keeps_nobody_out(guarded):
    cookie = "robotont_teleop=" + guarded.access.cookie
    page = guarded.ready_page(Cookie=cookie)
    known = http.client.HTTPConnection("127.0.0.1", guarded.port, timeout=10)
    with contextlib.closing(known), contextlib.ExitStack() as strangers:
        def ask():
            known.request("GET", "/map.png", headers={"Cookie": cookie})
            answer = known.getresponse()
            assert answer.read()
            return answer.status
        assert ask() == 200
        socket_of_known = known.sock
        for start in (b"", b"GET / HTTP/1.1\r\nX: ",
                      f"GET /app.js HTTP/1.1\r\nHost: 127.0.0.1:{guarded.port}\r\n\r\n".encode()):
            for _ in range(2 * MAX_CONNECTIONS):
                stranger = strangers.enter_context(socket.create_connection(("127.0.0.1", guarded.port)))
                with contextlib.suppress(OSError):
                    stranger.sendall(start)
            assert guarded.request("GET", "/")[0] == 401
            assert guarded.request("GET", "/", Cookie=cookie)[0] == 200
            guarded.ready_page(Cookie=cookie).close()
        assert ask() == 200
        assert known.sock is socket_of_known, "the connection of one who has the token was closed"
        seen = page.states
        wait_for(lambda: page.states > seen + 3, "states")
        assert not page.closed


def test_a_stranger_writes_no_line_into_the_log(guarded, caplog):
    """As many as he likes: on the teacher's terminal, and in the node's file, whose oldest lines go then."""
    caplog.set_level("INFO")
    for kind, body in (("application/x-www-form-urlencoded", b"token=%ff"), ("multipart/form-data; boundary=x", b"y")):
        answer = guarded.request("POST", "/login", body, Content_Type=kind, Origin=f"http://127.0.0.1:{guarded.port}")
        assert answer[0] in (400, 401)  # an older tornado reads the second as an empty form
    assert caplog.messages == []


def test_a_slow_reader_holds_up_nobody_and_is_closed(monkeypatch):
    monkeypatch.setattr("robotont_teleop.web.web_server.PING", 0.5)
    with Served() as served, open_socket(served.port) as slow:
        served.robot.told = {"frame": "x" * 20000}
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        good = served.ready_page()
        assert len(served.server.pages) == 2
        seen = good.states
        wait_for(lambda: len(served.server.pages) == 1, "the end of the slow page", timeout=15)
        assert good.states > seen + 5
