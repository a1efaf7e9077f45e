"""Nodes and tools end when they are told to, though the ROS master hangs."""

import os
import pty
import signal
import subprocess
import xmlrpc.client

import pytest

from robotont_testing import places
from robotont_testing.harness import START, Master, suspended, wait_for, wait_for_master

NODES = (("robotont_driver", "robotont_node"), ("robotont_driver", "driver_node"), ("robotont_driver", "odom_node"),
         ("robotont_driver", "serial_com_node"), ("robotont_teleop", "cmd_vel_mux"),
         ("robotont_teleop", "web_teleop_node"), ("robotont_teleop", "gamepad_teleop"),
         ("robotont_operations", "recorder_node"), ("robotont_simulator", "simulator_node"))
BEFORE_IT_IS_KILLED = 8.0  # [s] roslaunch and systemd do so after 10 and more


@pytest.fixture(name="master", scope="module")
def _master():
    with Master() as master:
        for file in ("robots/thesis/wheel_params", "robots/thesis/driver", "simulator"):
            subprocess.run(["rosparam", "load", str(places.config(file + ".yaml"))], check=True)
        yield master


def publishes(master, name):
    """Whether the master knows a publisher, beside /rosout, of a node whose name begins so."""
    publishers, _, _ = xmlrpc.client.ServerProxy(master.uri).getSystemState("/test")[2]
    return any(node.startswith("/" + name) for topic, nodes in publishers if topic != "/rosout" for node in nodes)


def ends(process):
    process.send_signal(signal.SIGTERM)
    wait_for(lambda: process.poll() is not None, "the end", BEFORE_IT_IS_KILLED)


@pytest.mark.parametrize("package, name", NODES, ids=[name for _, name in NODES])
def test_a_node_ends(master, package, name):
    log = master.folder / "log"
    arguments = {"web_teleop_node": ["_port:=0"], "recorder_node": [f"_folder:={master.folder}/black_box"],
                 "simulator_node": [f"_port:={master.folder}/board"]}
    node = master.start(places.program(package, name), *arguments.get(name, ()), log=log)
    wait_for(lambda: publishes(master, name) or node.poll() is not None, name, START)
    assert node.poll() is None, log.read_text()
    with suspended(wait_for_master(master.uri)):
        ends(node)
    assert "Traceback" not in log.read_text()


def test_the_keys_end(master):
    terminal, side = pty.openpty()
    shown = b""
    keys = subprocess.Popen([str(places.program("robotont_teleop", "keyboard_teleop"))], stdin=side, stdout=side)
    try:
        while b"no odometry" not in shown:  # its line of status
            shown += os.read(terminal, 1000)
        with suspended(wait_for_master(master.uri)):
            ends(keys)
    finally:
        keys.kill()
        os.close(terminal)
        os.close(side)
