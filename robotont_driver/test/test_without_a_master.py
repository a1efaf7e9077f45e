"""A node or a tool that finds no ROS master says so in one line, and ends by Ctrl-C meanwhile; also where one hangs."""

import os
import signal
import socket
import subprocess
import sys

from robotont_testing import places
from robotont_testing.harness import free_port


def test_ctrl_c_while_it_waits():
    uri = f"http://127.0.0.1:{free_port()}"
    node = subprocess.Popen([sys.executable, str(places.program("robotont_driver", "driver_node"))], text=True,
                            stderr=subprocess.PIPE, env={**os.environ, "ROS_MASTER_URI": uri})
    assert node.stderr.readline() == f"driver_node: no ROS master at {uri}: waiting 10 s for one\n"
    node.send_signal(signal.SIGINT)
    assert node.communicate(timeout=2.0)[1] == ""
    assert node.returncode == -signal.SIGINT


def tool(uri):
    """A program that becomes a node as ./robotont keys and goto do."""
    program = "from robotont_driver.rospy_repairs import rospy_process as it; it.SILENCE = 0.2; it.init_tool('a_tool')"
    return subprocess.Popen([sys.executable, "-c", program], text=True, stderr=subprocess.PIPE,
                            env={**os.environ, "ROS_MASTER_URI": uri})


def test_a_tool_says_that_the_master_hangs_and_that_there_is_none():
    with socket.create_server(("127.0.0.1", 0)) as hung:
        uri = f"http://127.0.0.1:{hung.getsockname()[1]}"
        waiting = tool(uri)
        assert waiting.stderr.readline() == f"a_tool: the ROS master at {uri} does not answer; waiting for it\n"
        waiting.send_signal(signal.SIGINT)
        assert "Error: no ROS master" in waiting.communicate(timeout=2.0)[1]  # rosgraph takes Ctrl-C for that
    uri = f"http://127.0.0.1:{free_port()}"
    assert f"NoMasterError: no ROS master at {uri}: is the robot running?" in tool(uri).communicate(timeout=20.0)[1]
