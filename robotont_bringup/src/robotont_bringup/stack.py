"""A stack under a ROS master of its own: for programs that start their robot, and leave nothing behind."""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import rosgraph
import rospy

from robotont_driver.rospy_repairs import rospy_internals

START = 60.0        # [s] for what is waited for
LONGEST_END = 20.0  # [s] that the stack may take to end


class StackError(RuntimeError):
    """The stack has ended, or something in it did not come in time."""


def scratch():
    """A temporary folder; ./robotont removes it whatever ends the program."""
    return tempfile.TemporaryDirectory(dir=os.environ.get("ROBOTONT_LIFELINE", "").rpartition(":")[2] or None)


@contextlib.contextmanager
def stack(name, folder, *words):
    """Roslaunch with `words` while the block lasts, its output in `folder`/stack.log; this program is its node `name`.

    Gives wait_for(condition, what), which raises StackError, as the start of the block does.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=str(folder))
    log = Path(folder) / "stack.log"
    with log.open("wb") as output:
        process = subprocess.Popen(["roslaunch", "-p", str(port), *map(str, words)], stdin=subprocess.DEVNULL,
                                   stdout=output, stderr=subprocess.STDOUT, start_new_session=True)

    def wait_for(condition, what):
        end = time.monotonic() + START
        while not condition():
            if process.poll() is not None or time.monotonic() > end:
                raise StackError(f"waited in vain for {what}; roslaunch:\n{log.read_text(errors='replace')[-3000:]}")
            time.sleep(0.02)
    try:
        wait_for(rosgraph.is_master_online, "the ROS master")
        rospy_internals.mend()
        rospy.init_node(name, disable_signals=True)
        yield wait_for
    finally:
        with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does
            process.wait(LONGEST_END)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
