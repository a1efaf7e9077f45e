"""Three robots, each with a master and a board of its own, one router and one page; what breaks is mended by itself."""

import io
import os
import signal
import struct
import subprocess
import time
from pathlib import Path

import pytest
from fleet_rig import Rig, stop_time, wait_until_driving
from geometry_msgs.msg import PoseStamped

from robotont_fleet import zenoh_keys as keys
from robotont_fleet.zenoh_setup import client_settings, open_session, zenoh
from robotont_testing import places
from robotont_testing.harness import suspended, wait_for
from robotont_testing.stalling_proxy import StallingProxy

pytestmark = [pytest.mark.skipif(zenoh is None, reason="no zenoh on this system"), pytest.mark.timed]
NAMES = ("r1", "r2", "r3")
CUT = 10.0  # [s]


@pytest.fixture(scope="module")
def rig():
    with Rig() as one:
        one.start_page()
        for name in NAMES:
            one.add_robot(name)
        wait_until_driving(one, *one.robots.values())
        yield one


@pytest.fixture
def adapter(rig):
    """A session like that of free_fleet's adapter."""
    with open_session(client_settings(f"tcp/127.0.0.1:{rig.router_port}")) as session:
        yield session


def bare_goal(session, name, x):
    message = PoseStamped()
    message.header.frame_id = "map"
    message.pose.position.x, message.pose.orientation.w = x, 1.0
    output = io.BytesIO()
    message.serialize(output)
    session.put(keys.ros_key(keys.GOAL, name), output.getvalue())


def click(rig, name, x, state=None):
    state = state or rig.seen(name)
    rig.order(kind="goal", name=name, id=state["id"], seen=state["number"], x=x, y=0.0)


def release(rig):
    for robot in rig.robots.values():
        robot.release()


@pytest.mark.long
def test_an_empty_battery_refuses_goals_of_both_kinds(rig, adapter):
    robot = rig.robots["r1"]
    robot.navigation.send_signal(signal.SIGUSR2)
    wait_for(lambda: rig.seen("r1")["battery"]["charge"] == 0.04, "the empty battery")
    click(rig, "r1", 3.5)
    bare_goal(adapter, "r1", 3.5)
    wait_for(lambda: robot.words().count("goal refused: the battery is empty") == 2, "two refusals")
    robot.navigation.send_signal(signal.SIGUSR2)
    wait_for(lambda: rig.seen("r1")["battery"]["charge"] == 0.75, "the new battery")
    assert "goal 3.5 0" not in robot.goals()


@pytest.mark.long
def test_a_goal_that_waited_is_refused_without_asking_a_clock_and_one_of_now_pursued_until_the_cancel(rig):
    robot, state = rig.robots["r1"], rig.seen("r1")
    wait_for(lambda: rig.seen("r1")["number"] > state["number"] + 2500, "2 s and more")
    click(rig, "r1", 4.0, state)
    wait_for(lambda: "goal refused" in rig.seen("r1")["note"], "the refusal")
    click(rig, "r1", 5.0, {"id": "another", "number": rig.seen("r1")["number"]})
    click(rig, "r1", 6.0)
    wait_for(lambda: "goal 6 0" in robot.goals(), "a fresh goal")
    assert not {"goal 4 0", "goal 5 0"} & set(robot.goals())
    rig.order(kind="cancel", name="r1")
    wait_for(lambda: "left 6" in robot.goals(), "the cancel")
    assert not rig.robots["r2"].goals()


@pytest.mark.long
def test_a_goal_that_waited_for_a_process_that_stood_is_refused_and_a_stop_obeyed(rig, adapter):
    robot = rig.robots["r2"]
    with suspended(robot.fleet_node.pid):
        bare_goal(adapter, "r2", 7.0)
        click(rig, "r2", 8.0)
        rig.order(kind="stop", name="r2")
        time.sleep(2.6)  # longer than ~oldest_goal
    wait_for(lambda: not robot.drives, "the stop")
    wait_for(lambda: rig.view()["stop"]["stand"] == 1, "the confirmation")
    assert not [line for line in robot.goals() if line.startswith("goal")]
    release(rig)


@pytest.mark.long
def test_no_goal_is_executed_that_was_sent_before_a_cut(rig):
    proxy = StallingProxy(rig.router_port)
    robot = rig.add_robot("r4", f"_router:=tcp/127.0.0.1:{proxy.port}", board=False)
    wait_for(lambda: rig.seen("r4"), "r4", 30.0)
    with open_session(client_settings(f"tcp/127.0.0.1:{rig.router_port}")) as session:
        proxy.stall()
        bare_goal(session, "r4", 9.0)
        click(rig, "r4", 9.0, rig.view()["robots"][-1])
        wait_for(lambda: not rig.seen("r4"), "the page to miss it", 30.0)
        time.sleep(CUT)
        click(rig, "r4", 9.0, rig.view()["robots"][-1])
        proxy.flow()
    wait_for(lambda: rig.seen("r4").get("age", 9.0) < 1.0, "r4 again", 30.0)
    time.sleep(1.0)
    assert robot.goals() == []
    rig.stop(robot.fleet_node, signal.SIGKILL)
    del rig.robots["r4"]
    proxy.close()


@pytest.mark.long
def test_the_router_is_killed_and_all_come_back_with_their_state(rig):
    began = rig.seen("r1")["id"]
    rig.stop(rig.page, signal.SIGKILL)
    assert all(rig.robots[name].drives for name in NAMES)  # the driver does not care
    rig.start_page()
    for name in NAMES:
        wait_for(lambda name=name: rig.seen(name).get("battery", {}).get("charge") == 0.75, f"{name} again", 30.0, 0.1)
    assert rig.seen("r1")["id"] == began


def test_stop_all_stands_all_wheels_and_each_robot_confirms(rig):
    wait_until_driving(rig, *(rig.robots[name] for name in NAMES))
    took = stop_time(rig, [rig.robots[name] for name in NAMES])
    print(f"\nSTOP ALL to the last wheel's zero: {1000 * took:.0f} ms")
    wait_for(lambda: rig.view()["stop"] == {"asked": 3, "stand": 3, "waiting": [], "gone": []}, "confirmations")
    assert all(rig.seen(name)["stopped"] for name in NAMES)
    click(rig, "r1", 5.5)
    wait_for(lambda: "emergency stop" in rig.seen("r1")["note"], "a refusal while it is pressed")
    release(rig)
    wait_until_driving(rig, *(rig.robots[name] for name in NAMES))
    assert took < 0.5


@pytest.mark.long
def test_a_robot_that_restarts_takes_its_card_back_and_the_stop_that_waits_but_no_goal(rig, adapter):
    """Computer and board fall, so that nothing remembers that it had stopped."""
    robot = rig.robots["r3"]
    robot.fall()
    wait_for(lambda: not rig.seen("r3"), "the page to miss r3", 30.0)
    last = next(one for one in rig.view()["robots"] if one["name"] == "r3")
    assert last["battery"]["charge"] == 0.75
    bare_goal(adapter, "r3", 9.5)
    click(rig, "r3", 9.5, last)
    rig.order(kind="stop", name="r3")
    assert rig.view()["stop"]["gone"] == ["r3"]
    robot.start(board=True)
    robot.start_fleet_node()
    wait_for(lambda: rig.view()["stop"]["stand"] == 1, "the confirmation", 60.0)
    wait_for(lambda: not robot.drives, "the stop")
    assert [one["name"] for one in rig.view()["robots"]].count("r3") == 1
    assert rig.seen("r3")["id"] != last["id"]
    assert not [line for line in robot.goals() if line.startswith("goal")]
    release(rig)


@pytest.mark.long
def test_a_clock_that_is_wrong_by_an_hour_and_set_changes_nothing(rig, adapter):
    """Of all that is on a robot; then it jumps, as by NTP."""
    library, ahead = rig.folder / "set_clock.so", rig.folder / "ahead"
    source = Path(__file__).resolve().parents[2] / "robotont_driver" / "test" / "set_clock.c"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(source)], check=True)
    ahead.write_bytes(struct.pack("d", 3600.0))
    robot = rig.add_robot("r5", LD_PRELOAD=str(library), CLOCK_AHEAD=str(ahead))
    try:
        wait_until_driving(rig, robot)
        for place in (1.5, 2.5):
            old = rig.seen("r5")
            wait_for(lambda: rig.seen("r5")["age"] < 1.0, "a young state")
            click(rig, "r5", place)
            wait_for(lambda: f"goal {place:g} 0" in robot.goals(), "the goal by click")  # noqa: B023
            bare_goal(adapter, "r5", place + 10)
            wait_for(lambda: f"goal {place + 10:g} 0" in robot.goals(), "the goal of free_fleet")  # noqa: B023
            time.sleep(2.6)
            click(rig, "r5", place + 20, old)
            wait_for(lambda: "may be" in rig.seen("r5")["note"], "the refusal of an old goal")
            with ahead.open("r+b") as file:  # in place: the processes have mapped it
                file.write(struct.pack("d", 0.0))
        assert stop_time(rig, [robot]) < 1.0
    finally:
        rig.stop(robot.fleet_node)
        robot.fall()
        del rig.robots["r5"]
        release(rig)


@pytest.mark.long
def test_two_robots_of_one_name_are_told_and_get_no_goals_but_stops(rig, adapter):
    two = rig.start("rosrun", "robotont_fleet", "fleet_node", "__name:=second", "_robot_name:=r1",
                    f"_router:=tcp/127.0.0.1:{rig.router_port}", **rig.robots["r2"].environment)
    named = lambda: [one for one in rig.view()["robots"] if one["name"] == "r1" and one.get("namesakes")]  # noqa: E731
    wait_for(lambda: len(named()) == 2, "both", 30.0)
    bare_goal(adapter, "r1", 7.5)
    wait_for(lambda: "another robot" in named()[0]["note"], "the refusal")
    rig.order(kind="stop", name="r1")
    wait_for(lambda: not rig.robots["r1"].drives and not rig.robots["r2"].drives, "both to stand")
    rig.stop(two)
    wait_for(lambda: rig.seen("r1").get("namesakes") == 0, "one to stay")
    assert "goal 7.5 0" not in rig.robots["r1"].goals() + rig.robots["r2"].goals()
    release(rig)


def test_a_fleet_node_without_a_driver_says_so_on_the_page(rig):
    lost = rig.start(places.program("robotont_fleet", "fleet_node"), "_robot_name:=r9",
                     f"_router:=tcp/127.0.0.1:{rig.router_port}", ROS_NAMESPACE="elsewhere",
                     **rig.robots["r3"].environment)
    wait_for(lambda: "no driver_node in /elsewhere/" in str(rig.seen("r9").get("worst")), "the words", 30.0)
    rig.stop(lost)


@pytest.mark.long
def test_garbage_from_the_network_harms_nobody(rig, adapter):
    for key in (keys.order_key("r1"), keys.ros_key(keys.GOAL, "r1"), keys.ros_key(keys.CANCEL, "r1")):
        for payload in (b"", b"\xff" * 50, b"[]", b"{}", b'{"kind": "goal", "id": 3}', os.urandom(2000)):
            adapter.put(key, payload)
    for payload in (b"", b"[]", b"{}", b"\xff" * 20000, b'{"id": 1, "number": "x"}'):
        adapter.put(keys.state_key("ghost"), payload)
    click(rig, "r1", 0.5)
    wait_for(lambda: "goal 0.5 0" in rig.robots["r1"].goals(), "a goal behind all that")
    assert rig.seen("r2")
    lines = rig.request("GET", "/metrics")[2].decode().splitlines()
    for name in NAMES:
        assert f'robotont_diagnostic{{robot="{name}",task="serial_com_node: link",key="level"}} 0' in lines
