"""The parts of a fleet alone, without network and clock."""

import json
import queue
import threading
from unittest.mock import Mock

import pytest
from fleet_rig import STATE

from robotont_fleet import fleet_node, fleet_page, fleet_server
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.fleet_page import StopFile
from robotont_fleet.known_robots import NEEDS, Fleet
from robotont_testing.harness import wait_for


class Class:
    """A Fleet, and robots that say what they are told to; what it sends and keeps."""

    def __init__(self, kept=None):
        self.sent, self.kept, self.now, self._number = [], None, 0.0, 0
        self.fleet = Fleet(
            lambda *order: self.sent.append(order), "page", lambda kept: setattr(self, "kept", kept), kept)

    def come(self, name, identity="a"):
        self.fleet.hear_token(name, identity, True, self.now)

    def go(self, name, identity="a"):
        self.fleet.hear_token(name, identity, False, self.now)

    def say(self, name, identity="a", number=None, **fields):
        self._number += 1
        self.fleet.hear_state(name, {**STATE, "id": identity, "number": number or self._number, **fields}, self.now)

    def confirm(self, name, identity="a"):
        self.say(name, identity, confirmed=[self.wanted(name)], stopped="/fleet_node")

    def wanted(self, name):
        return self.kept["all"] or self.kept["some"][name]

    def repeated(self):
        """Names to whom a stop is sent now."""
        del self.sent[:]
        self.fleet.repeat(self.now)
        assert all(order["number"] == self.wanted(name) for name, order in self.sent)
        return [name for name, _ in self.sent]

    def stop(self):
        return {key: value for key, value in self.fleet.view(self.now)["stop"].items() if key != "newest"}

    def release(self):
        """By a person who has seen all; what goes out."""
        del self.sent[:]
        assert self.fleet.release(self.fleet.view(self.now)["stop"]["newest"])
        return self.sent

    def needs(self):
        return {one["name"]: one["need"] for one in self.fleet.view(self.now)["robots"]}


@pytest.fixture
def room():
    room = Class()
    for name in ("r1", "r2"):
        room.come(name)
        room.say(name)
    return room


def test_a_stop_for_all_holds_for_who_blinks_joins_and_restarts_until_somebody_ends_it(room):
    room.fleet.stop()
    assert room.sent[-2:] == [(name, {"kind": "stop", "number": room.kept["all"]}) for name in ("r1", "r2")]
    room.confirm("r1")
    assert room.repeated() == ["r2"]
    room.confirm("r2")
    assert room.repeated() == []
    assert room.stop() == {"all": True, "stand": ["r1", "r2"], "waiting": [], "gone": [], "left": []}
    room.go("r2")
    assert (room.stop()["gone"], room.repeated()) == (["r2"], [])
    room.come("r2")  # it was cut off
    assert (room.sent[-1][0], room.stop()["waiting"], room.repeated()) == ("r2", ["r2"], ["r2"])
    room.confirm("r2")
    room.go("r2")
    room.come("r2", "b")  # it has restarted
    room.come("r3")       # a new one
    assert room.repeated() == ["r2", "r3"]
    room.confirm("r2", "b")
    room.confirm("r3")
    assert room.repeated() == []
    room.say("r3", confirmed=[])  # somebody has released it beside
    assert (room.repeated(), room.needs()["r3"]) == (["r3"], "waits")
    room.release()
    room.come("r4")
    assert room.repeated() == []


def test_nothing_but_the_newest_word_of_who_is_there_confirms_a_stop(room):
    room.fleet.stop()
    room.say("r1", confirmed=["another"])
    room.say("r1", "never seen", confirmed=[room.kept["all"]])
    assert room.repeated() == ["r1", "r2"]
    room.go("r1")
    room.confirm("r1")  # on its way when it went
    assert room.stop()["gone"] == ["r1"]
    room.come("r1")
    assert room.repeated() == ["r1", "r2"]
    room.say("r1", number=100, confirmed=[])
    room.say("r1", number=99, confirmed=[room.kept["all"]])  # of before
    assert room.repeated() == ["r1", "r2"]
    room.say("r1", number=101, confirmed=[room.kept["all"]])
    assert room.repeated() == ["r2"]
    room.now += 2.1  # and then not a word
    assert (room.stop()["waiting"], room.repeated()) == (["r1", "r2"], ["r1", "r2"])


def test_a_stop_for_one_holds_also_for_who_is_gone_and_counts_apart_from_that_for_all(room):
    room.go("r2")
    room.fleet.stop("r2")
    number = room.kept["some"]["r2"]
    assert room.stop() == {"all": False, "stand": [], "waiting": [], "gone": ["r2"], "left": []}
    room.fleet.stop("r2")
    assert room.kept["some"]["r2"] == number
    room.come("r2", "b")
    assert room.repeated() == ["r2"]
    room.release()
    assert room.kept["some"] == {}
    room.fleet.stop("r2")
    room.fleet.stop()
    everyone = room.kept["all"]
    room.fleet.stop("r1")
    room.fleet.stop()
    assert (room.kept["all"], room.kept["some"]) == (everyone, {})
    assert room.stop()["waiting"] == ["r1", "r2"]


def test_a_robot_that_blinks_keeps_its_card_and_of_namesakes_each_must_confirm(room):
    def cards():
        return [(one["id"], one["present"], one.get("number")) for one in room.fleet.view(0.0)["robots"]
                if one["name"] == "r1"]
    room.say("r1", number=9)
    room.go("r1")
    room.now = 60.0
    room.come("r1")
    assert cards() == [("a", True, 9)]
    assert room.needs()["r1"] == ""  # not silent: it has just come
    assert [one["age"] for one in room.fleet.view(room.now)["robots"] if one["name"] == "r1"] == [60.0]
    room.go("r1")
    room.come("r1", "b")
    assert cards() == [("b", True, None)]
    room.come("r1", "c")
    assert room.needs()["r1"] == "namesakes"
    room.fleet.stop("r1")
    room.confirm("r1", "b")
    assert room.repeated() == ["r1"]
    room.confirm("r1", "c")
    assert room.repeated() == []
    room.go("r1", "b")
    room.go("r1", "c")
    assert [one[:2] for one in cards()] == [("c", False)]


def test_a_release_lets_go_who_is_there_and_stands_by_this_page_and_tells_who_is_left(room):
    room.fleet.stop()
    number = room.kept["all"]
    room.say("r1", number=50, confirmed=["other-1", number])
    room.come("r3")
    room.confirm("r3")
    room.go("r3")
    room.say("r2", confirmed=["other-1"])
    assert room.release() == [("r1", {"kind": "release", "number": number, "id": "a", "seen": 50})]
    assert room.stop() == {"all": False, "stand": [], "waiting": [], "gone": [], "left": ["r1"]}
    assert room.kept["all"] is None
    room.come("r3")  # it had not heard
    room.say("r3", confirmed=[number])
    assert room.stop()["left"] == ["r1", "r3"]
    room.say("r1", number=51, confirmed=[])
    assert [name for name, _ in room.release()] == ["r3"]


@pytest.mark.parametrize("name", [None, "r1"])
def test_a_release_that_was_asked_for_before_the_newest_press_ends_nothing(room, name):
    room.fleet.stop()
    asked = room.fleet.view(room.now)["stop"]["newest"]
    room.fleet.stop(name)
    room.confirm("r1")
    room.confirm("r2")
    del room.sent[:]
    assert not room.fleet.release(asked)
    assert not Class(room.kept).fleet.release(asked)
    assert (room.sent, room.stop()["all"]) == ([], True)
    assert [order["kind"] for _, order in room.release()] == ["release", "release"]


def test_stops_survive_the_page_and_its_file_is_read_in_doubt_as_a_stop(room, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "new"))
    file = StopFile(8110)
    assert file.read() == {}
    room.fleet.stop()
    room.come("r3")
    file.write(room.kept)
    wait_for(file.read, "the file")
    assert (tmp_path / "new" / "robotont_fleet_stops_8110.json").stat().st_mode & 0o777 == 0o600
    after = Class(file.read())
    assert after.stop() == {"all": True, "stand": [], "waiting": [], "gone": ["r1", "r2", "r3"], "left": []}
    assert Class({**file.read(), "all": None, "some": {"r2": "a"}}).stop()["gone"] == ["r2"]
    after.come("r1")
    assert after.sent == [("r1", {"kind": "stop", "number": room.kept["all"]})]
    for damaged in ("", "5", "{}", '{"all": null, "some": [1], "names": []}'):
        (tmp_path / "new" / "robotont_fleet_stops_8110.json").write_text(damaged)
        assert file.read() is None
    assert "STOP ALL holds" in capsys.readouterr().err
    after = Class(None)  # of the page whose file was spoilt
    after.come("r1")
    after.say("r1", confirmed=[room.kept["all"], "page-2-1"])
    assert after.sent == []
    assert [order["number"] for _, order in after.release()] == [room.kept["all"]]


def test_of_who_never_was_there_nothing_is_remembered(room):
    room.say("r1", "another")
    room.say("never there")
    assert [(one["name"], one["id"]) for one in room.fleet.view(0.0)["robots"]] == [("r1", "a"), ("r2", "a")]


def test_who_needs_somebody_comes_first_and_is_counted():
    room = Class()
    worst = {"task": "link", "words": "no board", "fault": ""}
    said = {"silent": {}, "no_driver": {"driver": False}, "error": {"worst": {**worst, "level": 2}},
            "empty": {"battery": {"voltage": 13.0, "charge": 0.05}}, "namesakes": {"namesakes": 1},
            "low": {"battery": {"voltage": 13.5, "charge": 0.15}}, "stopped": {"stopped": "/keys"},
            "warning": {"worst": {**worst, "level": 1}}, "well": {}, "gone": {}, "waits": {}, "held": {}}
    for name in said:
        room.come(name)
    room.say("silent")
    room.now = 5.1
    for name, fields in said.items():
        if name != "silent":
            room.say(name, **fields)
    room.go("gone")
    for name in ("waits", "held"):
        room.fleet.stop(name)
    room.confirm("held")
    view = room.fleet.view(room.now)
    assert {name: need or "well" for name, need in room.needs().items()} == {name: name for name in said}
    assert [one["need"] for one in view["robots"]] == list(NEEDS)
    assert view["need"] == 8


@pytest.fixture
def node(monkeypatch):
    """A FleetNode without its threads; `now`: [s] of the clock that a suspended computer does not stop."""
    node = fleet_node.FleetNode.__new__(fleet_node.FleetNode)
    node._identity, node._others, node._held, node._note, node._noted = "a", set(), [], "", 0.0
    node._orders, node._due = queue.Queue(fleet_node.WAITING), Mock()
    node._robot = Mock(stopped_from_here=False, state=dict, release=Mock(return_value=""))
    node.now = 100.0
    monkeypatch.setattr(fleet_node, "boot_time", lambda: node.now, raising=False)
    monkeypatch.setattr(fleet_node, "zenoh", Mock())
    for log in ("logwarn", "logwarn_throttle_identical"):
        monkeypatch.setattr(fleet_node.rospy, log, Mock())
    return node


def said(node):
    return json.loads(node._state())


def test_however_many_orders_come_none_of_them_waits_for_room_and_garbage_takes_none(node):
    for payload in (b"[", *[b'{"kind": "stop", "number": "p-1"}'] * (fleet_node.WAITING + 1)):
        node._take(Mock(payload=payload))
    assert (node._orders.qsize(), node._orders.get()["kind"]) == (fleet_node.WAITING, "stop")


def test_without_a_router_the_word_of_who_presses_never_waits_for_room(monkeypatch, tmp_path):
    """It waited for ever behind the thousandth, in rospy's thread, so that nothing more was heard on that topic."""
    for name in ("RobotTelemetry", "Health", "robot_name"):
        monkeypatch.setattr(fleet_node, name, Mock())
    monkeypatch.setattr(fleet_node, "zenoh", None)
    monkeypatch.setattr(fleet_node, "ros_home", lambda: tmp_path)
    fleet_node.FleetNode({"robot_name": "r1", "router": "tcp/127.0.0.1:7447"})
    hear, = fleet_node.RobotTelemetry.call_args[0][:1]
    rospy_thread = threading.Thread(target=lambda: [hear(None) for _ in range(fleet_node.WAITING + 2)], daemon=True)
    rospy_thread.start()
    rospy_thread.join(10.0)
    assert not rospy_thread.is_alive()


def test_why_an_order_was_refused_is_not_told_for_ever(node):
    node._refuse("goal refused: the emergency stop is pressed")
    assert "the emergency stop" in said(node)["note"]
    node.now += 3600.0
    assert said(node)["note"] == ""


def test_what_a_fleet_node_before_this_one_has_stopped_any_page_lets_go_but_not_over_a_newer_stop(room, node):
    """A room whose r1 has a new process, "a", and no memory."""
    assert said(node)["confirmed"] == []
    node._robot.stopped_from_here = True
    room.say("r1", number=said(node)["number"], confirmed=said(node)["confirmed"], stopped="/fleet_node")
    assert room.stop()["left"] == ["r1"]
    assert room.needs()["r1"] == "stopped"
    (name, order), = room.release()
    assert (name, order["id"]) == ("r1", "a")
    node._on_order(order)
    node._robot.release.assert_called_once_with()
    node._stop("another-1")
    assert said(node)["confirmed"] == ["another-1"]
    node._on_order(order)
    assert node._note == "not released: it was released already"
    node._robot.release.assert_called_once_with()
    room.say("r2", "b", confirmed=["b"])  # of who never was there
    assert room.stop()["left"] == ["r1"]


def test_of_two_robots_of_one_name_none_gets_a_goal(node):
    alive = {one: Mock(key_expr=keys.alive_key("r1", one), kind="PUT") for one in ("a", "b")}
    for one in alive.values():
        node._on_namesake(one)
    node.name = "r1"
    goal = {"kind": "goal", "id": "a", "seen": said(node)["number"], "x": 1.0, "y": 0.0}
    node._on_order(goal)
    assert node._note == "goal refused: another robot is called r1, too"
    assert said(node)["namesakes"] == 1
    node._on_namesake(Mock(key_expr=keys.alive_key("r1", "b"), kind=fleet_node.zenoh.SampleKind.DELETE))
    node._on_order({**goal, "id": "another"})
    assert not node._robot.goal.called
    node._on_order(goal)
    node._robot.goal.assert_called_once_with(1.0, 0.0)


@pytest.mark.parametrize("slept, goes", [(2.0, True), (2.1, False), (-0.1, False), (3600.0, False)])
def test_a_goal_or_release_of_another_age_is_refused_also_behind_a_sleep_of_the_robots_computer(node, slept, goes):
    node._held = ["p-1"]
    now = {"id": "a", "seen": said(node)["number"]}
    for order in ({"kind": "release", "number": "p-1"}, {"kind": "goal", "x": 1.0, "y": 0.0}):
        node._orders.put({**order, **now})
    node.now += slept  # time.monotonic() stands still
    node._robot.goal.return_value = ""
    for kind in ("release", "goal"):
        node._obey()
        assert node._note == ("" if goes else f"{kind} refused: it may be {slept:.1f} s old, allowed: 2 s")
    assert node._robot.goal.called == node._robot.release.called == goes


def test_what_was_heard_before_the_pages_computer_slept_is_old(monkeypatch):
    slept = [0.0]
    for module in (fleet_page, fleet_server):
        monkeypatch.setattr(module, "boot_time", lambda: 100.0 + slept[0], raising=False)
    loop = Mock(call_soon_threadsafe=lambda call, *values: call(*values))
    monkeypatch.setattr(fleet_page, "zenoh", Mock())
    side = fleet_page.ZenohSide(Mock(), loop, Mock(read=dict, page="page"))
    side._on_token(Mock(key_expr=keys.alive_key("r1", "a"), kind=fleet_page.zenoh.SampleKind.PUT))
    side._on_state(Mock(key_expr=keys.state_key("r1"), payload=json.dumps(STATE).encode()))
    pages = []
    page = Mock(server=Mock(fleet=side.fleet, ground=None), finish=pages.append)
    for slept[0] in (0.0, 3600.0):
        fleet_server.RobotsHandler.get(page)
    assert [(one["age"], one["need"]) for shown in pages for one in shown["robots"]] == [(0.0, ""), (3600.0, "silent")]
