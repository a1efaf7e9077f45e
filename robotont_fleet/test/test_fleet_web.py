"""The fleet's page: its server's doors, and the page in a real browser, with robots that only write down."""

import asyncio
import contextlib
import http.client
import json
import time
from pathlib import Path

import pytest
from fleet_rig import STATE

from robotont_fleet.fleet_page import page_files, read_ground
from robotont_fleet.fleet_server import FleetServer
from robotont_fleet.known_robots import NEEDS, Fleet
from robotont_fleet.messages import read_state
from robotont_teleop.web.access import Access
from robotont_testing.browser import DESKTOP, one_browser
from robotont_testing.harness import tool_module, wait_for
from robotont_testing.loop_client import LoopClient
from robotont_testing.places import config

TOKEN = "the-token-of-these-tests"
SMALL = (360, 740, 2)


class Served(LoopClient):
    """A server in its loop, with robots that confirm each stop at once, but for robot2."""

    def __init__(self, robots, token=None):
        super().__init__()
        self._robots, self._access = robots, Access(token, "robotont_fleet")
        self.sent, self.states, self.there = [], {}, set()

    def __enter__(self):
        super().__enter__()
        self.do(self._start())
        return self

    async def _start(self):
        self.fleet = Fleet(self._send, "page", lambda kept: setattr(self, "stops", kept))
        server = FleetServer(self.fleet, self._access, ("fleet.local",), page_files(),
                             read_ground(str(config("maps/room.yaml"))), self)
        server.listen("127.0.0.1", 0)
        self.port = server.port
        for number in range(self._robots):
            self.say(f"robot{number}", pose=[0.5 + number % 8, 0.5 + number // 8, number], frame="map")

    async def kept(self):
        """As of a StopFile."""

    def say(self, name, present=True, **fields):
        self.states[name] = {**STATE, "id": name, "number": 7, "page": "http://192.0.2.1:8100/",
                             **self.states.get(name, {}), **fields}
        now = time.monotonic()
        if present != (name in self.there):
            self.there ^= {name}
            self.fleet.hear_token(name, name, present, now)
        self.fleet.hear_state(name, read_state(json.dumps(self.states[name]).encode()), now)

    def _send(self, name, order):
        self.sent.append((name, order))
        if name != "robot2" and order["kind"] in ("stop", "release"):
            stops = order["kind"] == "stop"
            self.loop.call_soon(lambda: self.say(name, stopped="/fleet_node" if stops else "",
                                                 confirmed=[order["number"]] if stops else []))

    def say_later(self, name, **fields):
        self.loop.call_soon_threadsafe(lambda: self.say(name, **fields))

    def ask(self, *request, **headers):
        return self.request(*request, **{"Origin": f"http://127.0.0.1:{self.port}", **headers})[0]


browser = pytest.fixture(scope="module")(one_browser)


def test_only_who_has_the_token_sees_and_orders():
    with Served(2, TOKEN) as server:
        stop = json.dumps({"kind": "stop"})
        for path in ("/robots", "/metrics", "/map.png"):
            assert server.ask("GET", path, Authorization="Bearer wrong") == 401
        assert server.ask("POST", "/order", stop) == 401
        assert b'id="token"' in server.request("GET", "/")[2]
        shown = server.request("GET", "/metrics", Authorization=f"Bearer {TOKEN}")[2]
        assert b'robotont_up{id="robot0",robot="robot0"} 1.0' in shown
        _, headers, _ = server.request("POST", "/login", f"token={TOKEN}", Origin=f"http://127.0.0.1:{server.port}",
                                       Content_Type="application/x-www-form-urlencoded")
        cookie = headers["Set-Cookie"].partition(";")[0]
        assert cookie.startswith("robotont_fleet=")
        assert server.ask("GET", "/robots", Cookie=cookie) == 200
        assert server.ask("POST", "/order", stop, Cookie=cookie, Origin="http://evil.example") == 403
        assert server.ask("GET", "/robots", Cookie=cookie, Host="evil.example") == 403
        assert server.sent == []
        assert server.ask("POST", "/order", stop, Cookie=cookie) == 204
        wait_for(lambda: len(server.sent) == 2, "the stops")


def test_what_is_no_order_is_refused_and_who_is_not_there_can_be_stopped_only():
    with Served(1) as server:
        for order in ("", "[" * 900, '{"kind": "drive"}', '{"kind": "stop", "name": "a/b"}', '{"kind": "goal"}',
                      '{"kind": "cancel", "name": "nobody"}'):
            assert server.ask("POST", "/order", order) == 400, order
        assert server.sent == []
        assert server.ask("POST", "/order", '{"kind": "stop", "name": "nobody"}') == 204
        assert list(server.stops["some"]) == ["nobody"]


def test_a_browser_that_has_gone_before_its_stop_is_on_the_disk_is_no_fault_of_the_page(caplog, monkeypatch):
    """The teacher's terminal showed a traceback for each telephone that had lost its Wi-Fi behind a press."""
    monkeypatch.setattr(Served, "kept", lambda _: asyncio.sleep(0.2))
    with Served(1) as server:
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", server.port)) as browser:
            browser.request("POST", "/order", '{"kind": "stop"}', {"Origin": f"http://127.0.0.1:{server.port}"})
            wait_for(lambda: server.sent, "the stop")
        assert server.ask("POST", "/order", '{"kind": "stop"}') == 204
    assert caplog.messages == []


HOLD_RELEASE = """new Promise((done) => {
  const send = (kind) => document.getElementById('release').dispatchEvent(new PointerEvent(kind));
  send('pointerdown');
  setTimeout(() => send('pointerup') && done(document.getElementById('stopping').hidden), 1500);
})"""


def test_stop_all_shows_who_stands_until_all_are_let_go_and_a_click_sends_a_robot(browser):
    with Served(3) as server:
        page = browser.page(f"http://127.0.0.1:{server.port}/", SMALL)
        page.wait("document.querySelectorAll('.card').length === 3", "three robots")
        page.tap("#stop_all")
        page.wait("document.getElementById('stopping').textContent.includes('Still asking: robot2.')", "who is missing")
        assert page.text("#stop_words").startswith("STOP: 2 of 3 have stopped.")
        assert page.text("#need") == "Need somebody: 1"
        assert page.text(".card h2") == "robot2"
        page.tap(".card:nth-child(2) .goal")
        x, y = page.place("#map")
        page.run(f"document.getElementById('map').dispatchEvent(new MouseEvent('click', {{clientX: {x}, clientY: {y}, "
                 "bubbles: true}))")
        wait_for(lambda: any(order["kind"] == "goal" for _, order in server.sent), "the goal")
        name, goal = next(one for one in server.sent if one[1]["kind"] == "goal")
        assert (name, goal["id"], goal["seen"]) == ("robot0", "robot0", 7)
        server.say_later("robot1", present=False)
        page.wait("document.querySelectorAll('.card[data-gone]').length === 1", "one that has gone")
        assert page.text("#count") == "2 of 3 connected"
        assert "stopped when back: robot1" in page.text("#stop_words")
        page.tap(".card[data-gone] .one")
        wait_for(lambda: page.run(HOLD_RELEASE), "the release")  # none before the page knows of the press
        assert ("robot0", "release") in [(name, order["kind"]) for name, order in server.sent]
        assert [words for words in page.complaints() if "(STOP was pressed again meanwhile)" not in words] == []
        page.close()


def test_a_stop_that_does_not_arrive_is_red_until_it_has(browser):
    """With a server that answers nothing, then errors, then as it should; never more than one question at a time."""
    fetch = """window.mode = "hang"; window.asked = 0; window.most = 0; const real = window.fetch;
        window.fetch = async (path, options) => {
          if (path.endsWith(".json")) return real(path);
          window.asked += path === "robots"; window.most = Math.max(window.most, window.asked);
          try {
            if (window.mode === "hang") await new Promise((_, no) => options.signal.onabort = () => no(Error("late")));
            return window.mode === "fail" ? new Response("", {status: 500}) : await real(path, options);
          } finally { window.asked -= path === "robots"; }
        };"""
    with Served(2) as server:
        page = browser.page(f"http://127.0.0.1:{server.port}/", SMALL, script=fetch)
        page.wait("document.getElementById('language').textContent", "the words")
        page.tap("#stop_all")
        page.wait("!document.getElementById('unsent').hidden && !document.getElementById('lost').hidden", "red")
        page.run("window.mode = 'fail'")
        page.wait("!document.getElementById('unsent').hidden", "red still")
        assert server.sent == []
        page.run("window.mode = ''")
        page.wait("document.getElementById('unsent').hidden && document.getElementById('lost').hidden", "its arrival")
        wait_for(lambda: len(server.sent) == 2, "the stops")
        page.wait("document.getElementById('stop_words').textContent.startsWith('STOP: 2 of 2')", "the robots' word")
        assert page.run("window.most") == 1
        page.run("window.mode = 'hang'")
        page.tap(".card .one")
        page.wait("!document.getElementById('unsent').hidden", "a STOP that hangs")
        page.run("window.mode = ''")
        arrived = len(server.sent)
        page.tap("#stop_all")
        wait_for(lambda: len(server.sent) > arrived, "a STOP that waits for none that hangs", timeout=1.5)
        page.wait("document.getElementById('unsent').hidden", "its arrival")
        page.close()


def test_all_is_said_in_three_languages(browser):
    with Served(1) as server:
        page = browser.page(f"http://127.0.0.1:{server.port}/", SMALL, language="de")
        page.wait("document.getElementById('count').textContent === '1 von 1 verbunden'", "German")
        assert page.text(".now") == "gefahren von hand · 0.10 m/s"
        server.say_later("robot0", driven_by="nobody")  # a program may drive past the mux, or there is none
        page.wait("document.querySelector('.now').textContent === '0.10 m/s'", "nothing that nobody knows")
        page.close()
    texts = json.loads(page_files()["fleet_texts.json"][1])
    assert b"router:=tcp/ADDRESS:7448<" in page_files(7448)["index.html"][1]
    assert [need for need in NEEDS if need and f"need_{need}" not in texts] == ["error", "warning"], "their fault has"


@pytest.mark.parametrize(("robots", "size", "dark"), [
    (0, SMALL, False), (40, SMALL, True), (40, DESKTOP, False)])
def test_the_page_fits_and_axe_finds_nothing(browser, size, dark, robots):
    with Served(robots) as server:
        worst = {"level": 2, "task": "serial_com_node: link", "words": "no board " * 12, "fault": ""}
        for name, fields in (("robot1", {"worst": worst}),
                             ("robot2", {"stopped": "/web_teleop_node"}), ("robot3", {"namesakes": 1, "page": ""}),
                             ("robot4", {"battery": {"voltage": 14.5, "charge": 0.07}}),
                             ("robot5", {"battery": {"voltage": 13.9, "charge": 0.03}})):
            if robots > 5:
                server.say_later(name, **fields)
        page = browser.page(f"http://127.0.0.1:{server.port}/", size, dark)
        page.wait(f"document.querySelectorAll('.card').length === {robots}", "the robots")
        page.wait("document.getElementById('count').textContent.includes('connected')", "the first answer")
        page.tap("#stop_all")
        page.wait("!document.getElementById('stopping').hidden", "the stop")
        for turned in (size, (size[1], size[0], size[2])):
            page.look(turned, dark)
            page.wait("document.documentElement.scrollWidth <= innerWidth", "all to fit")
        page.run((Path(tool_module("axe_core_python").__file__).parent / "axe.min.js").read_text())
        found = page.run("axe.run({exclude: ['#map text']}).then((result) => result.violations.map("  # it sees no halo
                         "(one) => one.id + one.nodes[0].html))")
        assert found == []
        assert page.complaints() == []
        page.close()
