"""The table of ./robotont status from nodes and diagnostics."""

from robotont_operations.health import ERROR, OK, STALE, WARN, Row, table, worst
from robotont_operations.status import show

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


def test_one_process_that_is_silent_or_says_nothing():
    assert table({"/robotont_node": False}, {})[0] == Row(ERROR, "nodes", "/robotont_node does not answer")
    rows = table({"/robotont_node": True}, {"odom_node: wheel feedback": FINE["odom_node: wheel feedback"]})
    assert Row(STALE, "link", "serial_com_node publishes nothing on /diagnostics") in rows
    assert not [row for row in rows if row.subject == "wheel feedback" and row.level == STALE]


def test_nodes_that_are_missing_silent_or_say_nothing():
    rows = table({"/driver_node": True, "/serial_com_node": False}, {})
    assert rows[0] == Row(ERROR, "nodes", "odom_node is not running; /serial_com_node does not answer")
    assert Row(STALE, "command stream", "driver_node publishes nothing on /diagnostics") in rows
    assert worst(rows) == 2


def test_a_level_that_is_none_is_an_error():
    rows = table(ALL, {**FINE, "camera: driver": (4, "odd"), "camera: lens": (-1, "odd")})
    assert rows[-2:] == [Row(ERROR, "driver", "odd"), Row(ERROR, "lens", "odd")]
    show(rows)


def test_of_robots_in_the_root_and_in_a_namespace_each_has_its_own_nodes_and_restarts():
    alive = {**ALL, **{f"/robot2{node}": node != "/driver_node" for node in ALL}, "/robot22/camera": True}
    rows = table(alive, {}, [("/robot2/driver_node", 3), ("/driver_node", 2), ("/odom_node", 1)])
    why = "; why: where the robot was started, or journalctl -u 'robotont*'"
    assert [row for row in rows if row.subject.endswith("nodes")] == [
        Row(WARN, "nodes", "4 running; restarts of /driver_node: 2; restarts of /odom_node: 1" + why),
        Row(ERROR, "robot2: nodes", "/robot2/driver_node does not answer; restarts of /robot2/driver_node: 3" + why)]


def test_two_robots():
    alive = {f"/{robot}{node}": True for robot in ("robot1", "robot2") for node in ALL}
    statuses = {f"{robot}{name}": status for robot in ("robot1/", "robot2/") for name, status in FINE.items()}
    statuses["robot2/serial_com_node: link"] = ERROR, "unplugged"
    rows = table(alive, statuses)
    assert Row(ERROR, "robot2: link", "unplugged") in rows
    assert Row(OK, "robot1: link", "50 packets/s") in rows
    assert len(rows) == 10
