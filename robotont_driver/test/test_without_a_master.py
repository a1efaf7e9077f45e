"""A node that finds no ROS master says so in one line, ends by Ctrl-C meanwhile, and gives up after a while."""

import os
import signal
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
