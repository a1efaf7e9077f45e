"""The stack on the simulator, under a ROS master of its own."""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
from pathlib import Path

import rosgraph

from robotont_demo.drive import wait_for

LONGEST_END = 20.0  # [s] that the stack may take to end


@contextlib.contextmanager
def simulated(robot):
    """simulation.launch of a robot (`read_robot`) while the block lasts; gives the file (Path) of its output."""
    # ./robotont removes its folder whatever ends the demo
    lifeline = os.environ.get("ROBOTONT_LIFELINE", "").rpartition(":")[2]
    with tempfile.TemporaryDirectory(dir=lifeline or None) as folder:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=folder)
        log = Path(folder) / "log"
        with open(str(log), "wb") as output:
            stack = subprocess.Popen(
                ["roslaunch", "-p", str(port), "robotont_bringup", "simulation.launch", f"port:={folder}/board",
                 f"robot:={robot.folder}/"],
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            wait_for(rosgraph.is_master_online, "the ROS master")
            yield log
        finally:
            os.killpg(stack.pid, signal.SIGINT)  # as Ctrl-C does
            try:
                stack.wait(LONGEST_END)
            except subprocess.TimeoutExpired:
                os.killpg(stack.pid, signal.SIGKILL)
                stack.wait()
