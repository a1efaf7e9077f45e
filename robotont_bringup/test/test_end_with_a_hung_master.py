"""Nodes and tools end when they are told to, though the ROS master hangs."""

import os
import pty
import signal
import subprocess
import sys
import time
import xmlrpc.client

from robotont_testing import places
from robotont_testing.harness import START, Master, suspended, wait_for, wait_for_master

NODES = (("robotont_driver", "robotont_node"), ("robotont_driver", "driver_node"), ("robotont_driver", "odom_node"),
         ("robotont_driver", "serial_com_node"), ("robotont_teleop", "cmd_vel_mux"),
         ("robotont_teleop", "web_teleop_node"), ("robotont_teleop", "joy_watch"),
         ("robotont_operations", "recorder_node"), ("robotont_simulator", "simulator_node"))
BEFORE_THEY_ARE_KILLED = 8.0  # [s] roslaunch and systemd do so after 10 and more


def publishing(master):
    """Names of the nodes that publish something, beside /rosout."""
    publishers, _, _ = xmlrpc.client.ServerProxy(master.uri).getSystemState("/test")[2]
    return {node.rpartition("/")[2] for topic, nodes in publishers if topic != "/rosout" for node in nodes}


def test_all_end():
    with Master() as master:
        for file in ("robots/thesis/wheel_params", "robots/thesis/driver", "simulator"):
            master.load(places.config(file + ".yaml"))
        arguments = {"web_teleop_node": ["_port:=0"], "recorder_node": [f"_folder:={master.folder}/black_box"],
                     "simulator_node": [f"_port:={master.folder}/board"]}
        terminal, side = pty.openpty()
        keys = subprocess.Popen([str(places.program("robotont_teleop", "keyboard_teleop"))], stdin=side, stdout=side)
        nodes = {name: master.start(places.program(package, name), f"__name:={name}", *arguments.get(name, ()),
                                    log=master.folder / name) for package, name in NODES}
        processes = {**nodes, "keyboard_teleop": keys}
        try:
            wait_for(lambda: set(nodes) <= publishing(master), "all nodes", START, 0.1)
            shown = b""
            while b"no odometry" not in shown:  # its line of status
                shown += os.read(terminal, 1000)
            with suspended(wait_for_master(master.uri)):
                end = time.monotonic() + BEFORE_THEY_ARE_KILLED
                for process in processes.values():
                    process.send_signal(signal.SIGTERM)
                for name, process in processes.items():
                    wait_for(lambda process=process: process.poll() is not None, f"the end of {name}",
                             end - time.monotonic())
            assert not [name for name in nodes if "Traceback" in (master.folder / name).read_text()]
        finally:
            keys.kill()
            os.close(terminal)
            os.close(side)


TOOL = """import sys
from robotont_driver.rospy_repairs.rospy_process import init_tool
init_tool("tool")
sys.exit(int(input("ready\\n")))
"""


def test_a_tool_ends_with_its_own_status():
    with Master() as master:
        tool = subprocess.Popen([sys.executable, "-c", TOOL], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert tool.stdout.readline() == b"ready\n"
        with suspended(wait_for_master(master.uri)):
            tool.communicate(b"7\n", timeout=BEFORE_THEY_ARE_KILLED)
        assert tool.returncode == 7
