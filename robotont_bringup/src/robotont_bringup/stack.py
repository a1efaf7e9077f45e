"""A stack under a ROS master of its own: for programs that start their robot, and leave nothing behind."""

import contextlib
import os
import signal
import socket
import subprocess
import tempfile

LONGEST_END = 20.0  # [s] that the stack may take to end


def scratch():
    """A temporary folder; ./robotont removes it whatever ends the program."""
    return tempfile.TemporaryDirectory(dir=os.environ.get("ROBOTONT_LIFELINE", "").rpartition(":")[2] or None)


@contextlib.contextmanager
def stack(folder, *words):
    """Roslaunch with `words` while the block lasts, its output in `folder`/stack.log; gives the process.

    This program talks to its master from now on.
    """
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=str(folder))
    with open(f"{folder}/stack.log", "wb") as output:
        process = subprocess.Popen(["roslaunch", "-p", str(port), *map(str, words)], stdin=subprocess.DEVNULL,
                                   stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does
            process.wait(LONGEST_END)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
