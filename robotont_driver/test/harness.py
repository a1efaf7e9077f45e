"""A ROS master of one's own, processes that end with it, and waiting for conditions."""

import os
import signal
import socket
import subprocess
import tempfile
import time
import xmlrpc.client
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def wait_for(condition, what, timeout=20.0, period=0.005):
    """The first true value of `condition()`; AssertionError that names `what` after `timeout` [s]."""
    end = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < end, "waited {} s in vain for {}".format(timeout, what)
        time.sleep(period)


def free_port():
    """A TCP port that nobody uses now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Master:
    """A private ROS master on a random port; the environment of this process then leads to it."""

    def __init__(self, start=True):
        self.uri = "http://127.0.0.1:{}".format(free_port())
        self._folder = tempfile.TemporaryDirectory(prefix="robotont_ros_")
        self._processes = []
        self._before = {name: os.environ.get(name) for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_LOG_DIR")}
        os.environ.update(ROS_MASTER_URI=self.uri, ROS_IP="127.0.0.1", ROS_LOG_DIR=self._folder.name)
        if start:
            self.start("rosmaster", "--core", "-p", self.port)
            self.wait()

    @property
    def port(self):
        """The port, as text."""
        return self.uri.rpartition(":")[2]

    @property
    def folder(self):
        """A folder that lives as long as the master: for logs and the names of serial ports."""
        return Path(self._folder.name)

    def wait(self):
        """Until the master answers."""
        wait_for(self._answers, "the ROS master")

    def _answers(self):
        try:
            return xmlrpc.client.ServerProxy(self.uri).getPid("/harness")[0] == 1
        except OSError:
            return False

    def start(self, *command, log=None, **environment):
        """Start a process; returns its Popen. `log`: a file for all that it prints."""
        output = open(log, "wb") if log else subprocess.DEVNULL
        process = subprocess.Popen(
            [str(word) for word in command], stdin=subprocess.DEVNULL, stdout=output,
            stderr=subprocess.STDOUT, env={**os.environ, **environment}, start_new_session=True)
        if log:
            output.close()
        self._processes.append(process)
        return process

    def launch(self, file, *arguments, log=None):
        """Start a launch file of the repository (or any path) with arguments such as port:=/dev/x."""
        return self.start("roslaunch", "-p", self.port, ROOT / "launch" / file, *arguments, log=log)

    def pid(self, node):
        """Process id of a node such as /odom_node."""
        code, words, uri = xmlrpc.client.ServerProxy(self.uri).lookupNode("/harness", node)
        assert code == 1, words
        return xmlrpc.client.ServerProxy(uri).getPid("/harness")[2]

    def stop(self, process, timeout=20.0):
        """End a process that was started here, as Ctrl-C does; returns its exit status."""
        if process in self._processes:
            self._processes.remove(process)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(timeout)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        return process.returncode

    def __enter__(self):
        """Nothing more to do."""
        return self

    def __exit__(self, *_):
        """End all, the newest first."""
        for process in reversed(list(self._processes)):
            self.stop(process)
        for name, value in self._before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        self._folder.cleanup()
