"""Who may do what on a network, and what happens where zenoh is not installed."""

import contextlib
import os
import subprocess
from types import SimpleNamespace

import pytest
from fleet_rig import Rig

from robotont_fleet import fleet_node
from robotont_fleet import zenoh_keys as keys
from robotont_fleet import zenoh_setup as setup
from robotont_fleet.zenoh_setup import client_settings, open_session, read_users, zenoh
from robotont_testing import places
from robotont_testing.harness import Master, free_port, wait_for

needs_zenoh = pytest.mark.skipif(zenoh is None, reason="no zenoh on this system")


def fleet(*arguments, **environment):
    return subprocess.run([places.program("robotont_fleet", "fleet"), *map(str, arguments)], text=True, check=False,
                          capture_output=True, env={**os.environ, **environment})


@pytest.fixture(scope="module")
def rig():
    with Rig() as one:
        one.home.mkdir()
        refused = fleet("--network", "--port", one.port, ROS_HOME=str(one.home))
        assert refused.returncode == 1
        assert "./robotont fleet --add" in refused.stderr
        added = fleet("--add", "r1", "r2", ROS_HOME=str(one.home))
        one.users = read_users(one.home / "robotont_fleet_users")
        home = one.folder / "robot's own"
        order = next(line for line in added.stdout.splitlines() if line.startswith("on r1: ")).partition(": ")[2]
        subprocess.run(["sh", "-c", order], check=True, env={**os.environ, "ROS_HOME": str(home)})
        assert setup.read_password(home / "robotont_fleet_password") == one.users["r1"]
        one.start_page("--network")
        yield one


def session(rig, user, password):
    """Of a user; raises zenoh.ZError where the router refuses him."""
    settings = client_settings(f"tcp/127.0.0.1:{rig.router_port}", user, password)
    return open_session({**settings, "connect/timeout_ms": 700, "connect/exit_on_failure": True})


@needs_zenoh
@pytest.mark.parametrize(("user", "password"), [("", ""), ("r1", "wrong"), ("teacher", "")])
def test_a_stranger_gets_in_neither_to_the_router_nor_to_the_page(rig, user, password):
    with pytest.raises(zenoh.ZError):
        session(rig, user, password)
    assert rig.request("GET", "/robots")[0] == 401
    assert rig.request("POST", "/order", '{"kind": "stop"}')[0] == 401


@needs_zenoh
def test_a_robot_gives_no_orders_to_another_and_hears_none_of_its_orders(rig):
    to_r1, to_r2, from_r2 = keys.order_key("r1"), keys.order_key("r2"), keys.state_key("r2")
    wanted = {"r1": {(to_r1, "teacher")}, "r2": {(to_r2, "teacher"), (from_r2, "r2")}}
    wanted["teacher"] = wanted["r1"] | wanted["r2"]
    heard = {name: set() for name in wanted}
    with contextlib.ExitStack() as stack:
        listening, sending = ({name: stack.enter_context(session(rig, name, rig.users[name])) for name in wanted}
                              for _ in range(2))  # what a session puts it hears itself in any case
        for name, one in listening.items():
            for key in (to_r1, to_r2, from_r2, "**"):
                one.declare_subscriber(key, lambda sample, name=name: heard[name].add(
                    (str(sample.key_expr), sample.payload.to_string())))
        for key in (to_r2, from_r2):
            sending["r1"].put(key, "r1 as another")

        def all_is_heard():
            for key, words in wanted["teacher"]:
                sending[words].put(key, words)
            return all(what <= heard[name] for name, what in wanted.items())
        wait_for(all_is_heard, "the teacher's orders", period=0.1)
    assert heard == wanted


@needs_zenoh
def test_states_and_orders_go_on_behind_a_jam():
    """A robot was silent to the page for ever, although connected, that had once been short of processor time."""
    port = free_port()
    heard = {"up": [], "down": []}
    with open_session(setup.router_settings(port)) as router, \
            open_session(client_settings(f"tcp/127.0.0.1:{port}")) as robot:
        for session, key in ((router, "up"), (robot, "down")):
            session.declare_subscriber(key, lambda sample, key=key: heard[key].append(len(sample.payload)))
        for session, key in ((robot, "up"), (router, "down")):
            wait_for(lambda session=session, key=key: setup.send(session, key, "x") or heard[key], "the connection",
                     period=0.1)
            for _ in range(2000):
                setup.send(session, key, b"x" * 20000)
            setup.send(session, key, b"x" * 3)
            wait_for(lambda key=key: heard[key][-1] == 3, "the first behind the jam", 60.0)


def test_without_zenoh_the_robot_drives_on_and_one_line_says_how_to_install_it(tmp_path):
    (tmp_path / "zenoh.py").write_text("raise ImportError('not here')\n")
    path = os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]])
    said = fleet(PYTHONPATH=path)
    assert said.returncode == 1
    assert said.stderr == f"fleet: {setup.ABSENT}\n"
    with Master() as master:
        log = tmp_path / "log"
        node = master.start(places.program("robotont_fleet", "fleet_node"), log=log, PYTHONPATH=path)
        wait_for(lambda: setup.ABSENT in log.read_text(), "the line")
        assert node.poll() is None
        assert log.read_text().count("\n") <= 2


def test_an_empty_password_is_none_and_stays_empty(tmp_path):
    file = tmp_path / "robotont_fleet_password"
    assert setup.read_password(file) == ""
    file.touch(0o600)
    with pytest.raises(ValueError, match="empty, allowed: the password that ./robotont fleet --add"):
        setup.read_password(file)
    assert not file.stat().st_size
    file.write_text("short")
    with pytest.raises(ValueError, match="found 5 characters, .*; write into it what ./robotont fleet --add prints$"):
        setup.read_password(file)


@needs_zenoh
def test_a_robot_says_whether_the_router_answers():
    """Zenoh answers itself where there is none."""
    node, port = fleet_node.FleetNode.__new__(fleet_node.FleetNode), free_port()
    node.name, node._password_file, node._parameters = "r1", "password", {"router": "there"}
    node._others, node._robot = (), SimpleNamespace(emergency_stop=SimpleNamespace(has_driver=True))
    with open_session(setup.router_settings(port)) as router, \
            open_session(client_settings(f"tcp/127.0.0.1:{port}")) as node._session:
        assert node._report()[1] == "connected"
        node._robot.emergency_stop.has_driver = False
        assert node._report()[1].startswith("no driver_node in /, so no stop and no goal reaches a robot")
        router.close()
        wait_for(lambda: node._report()[1].startswith("no answer from there: "), "the end of the connection")
        assert "its password for r1 in password " in node._report()[1]
