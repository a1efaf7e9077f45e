"""Robots, each with a board of its own, one router and one page; what breaks is mended by itself."""

import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest
from fleet_rig import PATIENCE, STATE, Rig, RobotRig, watch_stop

from robotont_fleet import zenoh_keys as keys
from robotont_fleet.zenoh_setup import zenoh
from robotont_teleop.hand.emergency_stop_publisher import HELD
from robotont_testing.figures import percentile
from robotont_testing.harness import wait_for

pytestmark = [pytest.mark.skipif(zenoh is None, reason="no zenoh on this system"), pytest.mark.timed]
FLOOD = 2.0  # [s]
PRESSES = int(os.environ.get("ROBOTONT_FLEET_PRESSES", "2"))  # of each kind
NAMES = ("r1", "r2", "r3")[:2 if PRESSES < 10 else 3]


@pytest.fixture(scope="module")
def rig():
    with Rig() as one:
        one.start_page()
        for name in NAMES:
            RobotRig(one, name)
        wait_for(lambda: all(robot.drives and one.seen(robot.name) for robot in one.robots.values()), "all to drive",
                 PATIENCE, period=0.1)
        yield one


@pytest.fixture(autouse=True)
def released(rig):
    """All drive when a test begins, and when it ends."""
    yield
    rig.release()


def present(view):
    """The time, by name of each robot that is there."""
    return {one["name"]: time.monotonic() for one in view["robots"] if one["present"]}


def press_during_a_cut(rig, chance):
    """Of all robots' networks, each of another length; some press before it, some in it."""
    ends = {}
    begins = chance.choice([0.0, 0.1])
    cuts = {name: chance.uniform(0.2, 5.0) for name in rig.robots}
    threading.Timer(begins, lambda: [robot.proxy.stall() for robot in rig.robots.values()]).start()
    for name, length in cuts.items():
        threading.Timer(begins + length, lambda name=name: (ends.update({name: time.monotonic()}),
                                                            rig.robots[name].proxy.flow())).start()
    time.sleep(0.1 + chance.uniform(0.0, 0.2))
    rig.order(kind="stop")
    return lambda _view: dict(ends)


def press_while_a_robot_starts_again(rig, chance):
    """One falls before, or just when somebody presses; the others stand at once."""
    robot = rig.robots[chance.choice(NAMES)]
    robot.fall()
    if chance.random() < 0.5:
        wait_for(lambda: not rig.seen(robot.name), "the page to miss it")
    rig.order(kind="stop")
    robot.start()
    return present


def press_before_the_page_dies(rig, chance):
    """Nobody hears it before it dies, with the router in it; it starts again."""
    for robot in rig.robots.values():
        robot.proxy.stall()
    time.sleep(chance.uniform(0.0, 0.1))
    rig.order(kind="stop")
    rig.stop(rig.page, signal.SIGKILL)
    for robot in rig.robots.values():
        robot.proxy.cut()
        robot.proxy.flow()
    assert all(robot.drives for robot in rig.robots.values())
    rig.start_page()
    return present


@pytest.mark.parametrize("press", [
    press_during_a_cut, press_before_the_page_dies,
    pytest.param(press_while_a_robot_starts_again, marks=pytest.mark.nightly)])
def test_every_robot_stands_as_soon_as_it_can_be_reached(rig, press):
    took, chance = [], random.Random(1)
    for _ in range(PRESSES):
        rig.release()
        took += watch_stop(rig, press(rig, chance))
    assert percentile(took, 0.99) <= 0.5


def test_who_joins_or_is_let_go_beside_stands_again_and_a_release_is_for_all_but_who_somebody_else_has_stopped(rig):
    rig.order(kind="stop")
    watch_stop(rig, present)
    robot = rig.robots["r1"]
    pressed = robot.words().count("emergency stop pressed")
    time.sleep(HELD)  # sooner it would be a release that was begun before the press, which the robot's side ends itself
    robot.release()
    wait_for(lambda: robot.words().count("emergency stop pressed") > pressed, "the press that follows the release")
    watch_stop(rig, present)
    subprocess.run(["rostopic", "pub", "-1", "/r1/emergency_stop", "std_msgs/Bool", "data: true"], check=True,
                   capture_output=True)
    wait_for(lambda: ", " in rig.seen("r1").get("stopped", ""), "a second press")
    rig.order(kind="release")
    wait_for(lambda: all(one.drives for one in rig.robots.values() if one is not robot), "the others to drive")
    wait_for(lambda: "also pressed by" in rig.seen("r1")["note"], "the reason")
    assert not robot.drives
    wait_for(lambda: rig.stop_state()["left"] == ["r1"], "the page to hear that the others go")
    wait_for(lambda: robot.release() or not rig.seen("r1")["note"], "the end of a reason that is over", 5.0, 0.5)


def test_garbage_from_the_network_does_not_delay_a_stop(rig):
    """As much as there is room for, on the keys of a robot's orders and of its states."""
    flood = f"""import json, os, itertools
from robotont_fleet.zenoh_setup import client_settings, open_session
session = open_session(client_settings("tcp/127.0.0.1:{rig.router_port}"))
garbage = [b"", bytes(50), b"[]", b"[" * 500, b'{{"kind": "goal", "id": 3}}', os.urandom(2000), os.urandom(100000)]
for number in itertools.count():
    session.put("{keys.order_key('r1')}", garbage[number % 7])
    session.put("{keys.state_key('r1')}", json.dumps({{**{STATE}, "id": str(number)}}) if number % 2 else garbage[3])
"""
    robot = rig.robots["r1"]
    rig.stop(robot.fleet_node)
    robot.start_fleet_node(rig.router_port)
    wait_for(lambda: rig.seen("r1"), "r1, without a proxy that would fill up")
    flooding = rig.start(sys.executable, "-c", flood)
    time.sleep(FLOOD)
    began = time.monotonic()
    rig.order(kind="stop")
    wait_for(lambda: not any(one.drives for one in rig.robots.values()), "all wheels' zeros", period=0.001)
    assert time.monotonic() - began < 0.5
    rig.stop(flooding, signal.SIGKILL)
    wait_for(lambda: len(rig.stop_state()["stand"]) == len(NAMES), "the confirmations")
