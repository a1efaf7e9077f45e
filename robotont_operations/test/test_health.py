"""The table of ./robotont status from nodes and diagnostics."""

from types import SimpleNamespace

import pytest
import rosgraph

from robotont_operations.health import ERROR, OK, STALE, WARN, Row, table, worst
from robotont_operations.status import CALLER, nodes_alive, restarts, show

ALL = {"/driver_node": True, "/serial_com_node": True, "/odom_node": True}
FINE = {
    "odom_node: wheel feedback": (OK, "50 packets/s"),
    "serial_com_node: link": (OK, "50 packets/s"),
    "serial_com_node: board": (OK, "robotont_firmware 1.0.0"),
    "driver_node: command stream": (OK, "following cmd_vel"),
}


def test_all_is_well():
    rows = table(ALL, FINE)
    assert rows == [Row(OK, "nodes", "3 running"), Row(OK, "command stream", "following cmd_vel"),
                    Row(OK, "link", "50 packets/s"), Row(OK, "board", "robotont_firmware 1.0.0"),
                    Row(OK, "wheel feedback", "50 packets/s")]
    assert worst(rows) == 0


@pytest.mark.parametrize("alive, faults", [
    ({"/robotont_node": False}, "/robotont_node does not answer"),
    ({"/driver_node": True, "/serial_com_node": False}, "odom_node is not running; /serial_com_node does not answer")])
def test_nodes_that_are_missing_or_silent(alive, faults):
    rows = table(alive, {})
    assert rows[0] == Row(ERROR, "nodes", faults)
    assert worst(rows) == 2


@pytest.mark.parametrize("alive", [ALL, {"/robotont_node": True}])
def test_nodes_that_say_nothing(alive):
    rows = table(alive, {"odom_node: wheel feedback": FINE["odom_node: wheel feedback"]})
    assert [row for row in rows if row.level == STALE] == [
        Row(STALE, subject, f"{node} publishes nothing on /diagnostics")
        for node, subject in (("serial_com_node", "link"), ("driver_node", "command stream"))]


def test_a_level_that_is_none_is_an_error():
    rows = table(ALL, {**FINE, "camera: driver": (4, "odd"), "camera: lens": (-1, "odd")})
    assert rows[-2:] == [Row(ERROR, "driver", "odd"), Row(ERROR, "lens", "odd")]
    show(rows)


def test_of_robots_in_the_root_and_in_a_namespace_each_has_its_own_nodes_restarts_and_diagnostics():
    alive = {**ALL, **{f"/robot2{node}": node != "/driver_node" for node in ALL}, "/robot22/camera": True}
    statuses = {**FINE, "robot2/serial_com_node: link": (ERROR, "unplugged")}
    rows = table(alive, statuses, [("/robot2/driver_node", 3), ("/driver_node", 2), ("/odom_node", 1)])
    why = "; why: where the robot was started, or journalctl -u 'robotont*'"
    assert [row for row in rows if row.subject.endswith(("nodes", "link"))] == [
        Row(WARN, "nodes", "4 running; restarts of /driver_node: 2; restarts of /odom_node: 1" + why),
        Row(OK, "link", "50 packets/s"),
        Row(ERROR, "robot2: nodes", "/robot2/driver_node does not answer; restarts of /robot2/driver_node: 3" + why),
        Row(ERROR, "robot2: link", "unplugged")]


def test_what_runs_in_no_robots_namespace_is_told_too():
    """A fleet_node without the robot's namespace reaches no robot, and says so."""
    alive = {**{f"/robot1{node}": True for node in ALL}, "/fleet_node": True}
    rows = table(alive, {**{f"robot1/{name}": status for name, status in FINE.items()},
                         "fleet_node: fleet": (ERROR, "no driver_node in /")})
    assert rows[-2:] == [Row(OK, "robot1: wheel feedback", "50 packets/s"),
                         Row(ERROR, "fleet_node: fleet", "no driver_node in /")]
    assert worst(rows) == 2


@pytest.mark.parametrize("uris", [{}, {"a": "http://127.0.0.1:1/", "b": 5}, 7, None])
def test_of_a_roslaunch_that_does_not_answer_no_restart_is_known(uris):
    assert restarts(SimpleNamespace(getParam=lambda _: uris)) == {}


def test_a_node_that_ends_while_the_master_is_asked_is_none(monkeypatch):
    def look_up(name):
        if name == "/gone":
            raise rosgraph.MasterError("unknown node")
        return "http://127.0.0.1:1/"
    master = SimpleNamespace(getSystemState=lambda: [[["/odom", ["/gone", "/driver_node", CALLER]]], [], []],
                             lookupNode=look_up)
    monkeypatch.setattr(rosgraph, "Master", lambda _: master)
    assert nodes_alive(master) == {"/driver_node": False}
