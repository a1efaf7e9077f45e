"""A ROS master of one's own, processes that end with it, and waiting for conditions."""

import contextlib
import functools
import importlib
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client
from pathlib import Path

import yaml

from robotont_testing import lifeline, places

START = 60.0  # [s] after which a launch file's nodes must be there, also on a machine with ten times as much to do

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a shell's background processes start so
    signal.signal(signal.SIGINT, signal.default_int_handler)  # else processes started here would ignore Ctrl-C too


def tool_module(name):
    """A module of setup/pypi/test.txt, also in a rostest, whose path is that of nodes; skips where there is none."""
    tools = os.environ.get("ROBOTONT_TOOLS")
    if tools and tools not in sys.path:
        sys.path.append(tools)
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise unittest.SkipTest(f"no {name} on this system") from error


def wait_for(condition, what, timeout=20.0, period=0.005):
    """The first true value of `condition()`; AssertionError that names `what` after `timeout` [s]."""
    end = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < end, f"waited {timeout} s in vain for {what}"
        time.sleep(period)


def again_until(act, condition, what, each=1.0, timeout=20.0):
    """`act()` again and again, as a person whom nothing answers, until `condition()` holds within `each` [s] of one."""
    def come():
        act()
        with contextlib.suppress(AssertionError):
            return wait_for(condition, what, each)
    return wait_for(come, what, timeout)


def in_own_process(test):
    """A test without arguments that runs in a process of its own: rospy.init_node works once in each."""
    file = test.__code__.co_filename
    program = f"""
import os, runpy, sys, traceback
sys.path.insert(0, {os.path.dirname(file)!r})
status = 1
try:
    runpy.run_path({file!r})[{test.__name__!r}].__wrapped__()
    status = 0
except BaseException:
    traceback.print_exc()
sys.stdout.flush()
os._exit(status)  # rospy's own end waits for ever for a thread that subscribes while the master goes
"""

    def run():
        result = subprocess.run([sys.executable, "-c", program], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, check=False, timeout=300)
        assert not result.returncode, f"exit status {result.returncode}: {result.stdout}"
    return functools.wraps(test)(run)


def free_port():
    """A TCP port that is free now, and none that the system may give to another node meanwhile (32768 to 60999)."""
    while True:
        port = random.SystemRandom().randrange(20000, 32768)
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            return port


def suspend(pid):
    """Stop a process as SIGSTOP does, and wait until all its threads stand: on a busy computer they run on a while."""
    os.kill(pid, signal.SIGSTOP)

    def stands():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # a thread has just ended
            states = [(task / "stat").read_text().rpartition(")")[2].split()[0]
                      for task in Path(f"/proc/{pid}/task").iterdir()]
            return set(states) == {"T"}
        return False
    wait_for(stands, f"process {pid} to stand")


@contextlib.contextmanager
def suspended(pid):
    """A block during which a process stands; behind it the process goes on."""
    suspend(pid)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def wait_for_master(uri, timeout=20.0):
    """Process id of the ROS master at `uri`, once it answers; AssertionError after `timeout` [s]."""
    def answer():
        try:
            return xmlrpc.client.ServerProxy(uri).getPid("/harness")[2]
        except OSError:
            return 0
    return wait_for(answer, f"the ROS master at {uri}", timeout)


class Processes:
    """Processes beside the ROS master that the environment names; they end with the `with` block or this process."""

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory(dir=str(lifeline.hold()))
        self._processes = []

    @property
    def folder(self):
        """A folder that lives as long as the processes: for logs and the names of serial ports."""
        return Path(self._folder.name)

    @property
    def uri(self):
        """The master's address."""
        return os.environ["ROS_MASTER_URI"].rstrip("/")

    def start(self, *command, log=None, **environment):
        """Start a process; returns its Popen. `log`: a file for all that it prints."""
        with open(str(log or os.devnull), "wb") as output:
            process = subprocess.Popen(
                [str(word) for word in command], stdin=subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT, env={**os.environ, **environment}, start_new_session=True)
        self._processes.append(process)
        return process

    def launch(self, file, *arguments, log=None, **environment):
        """Start a shipped launch file (or one at any path) with arguments such as port:=/dev/x."""
        port = self.uri.rpartition(":")[2]
        return self.start("roslaunch", "-p", port, places.launch(file), *arguments, log=log, **environment)

    def node(self, name, *arguments, log=None, **environment):
        """Start a node of robotont_driver with arguments such as _port:=/dev/x."""
        return self.start(places.program("robotont_driver", name), *arguments, log=log, **environment)

    def load(self, parameters, namespace="/"):
        """Set parameters, a dict or a YAML file, as rosparam load does; that takes half a second of processor time."""
        master = xmlrpc.client.ServerProxy(self.uri)
        given = parameters if isinstance(parameters, dict) else yaml.safe_load(Path(parameters).read_text())
        for name, value in given.items():
            master.setParam("/harness", namespace.rstrip("/") + "/" + name, value)

    def pid(self, node):
        """Process id of a node such as /odom_node, or of the robotont_node that it is a part of."""
        return xmlrpc.client.ServerProxy(self.node_uri(node)).getPid("/harness")[2]

    def node_uri(self, node):
        """Address of a node such as /odom_node, or of the robotont_node that it is a part of."""
        master = xmlrpc.client.ServerProxy(self.uri)
        for name in (node, node.rpartition("/")[0] + "/robotont_node"):
            code, words, uri = master.lookupNode("/harness", name)
            if code == 1:
                return uri
        raise AssertionError(words)

    def stop(self, process, how=signal.SIGINT, timeout=20.0):
        """End a process that was started here, by default as Ctrl-C does; returns its exit status."""
        if process in self._processes:
            self._processes.remove(process)
        if process.poll() is None:
            os.killpg(process.pid, how)
            try:
                process.wait(timeout)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        return process.returncode

    def close(self):
        """End all, the newest first."""
        for process in reversed(list(self._processes)):
            self.stop(process)
        self._folder.cleanup()

    def __enter__(self):
        """Nothing more to do."""
        return self

    def __exit__(self, *_):
        """End all."""
        self.close()


class Master(Processes):
    """A private ROS master on a random port; the environment of this process leads to it."""

    def __init__(self, start=True):
        super().__init__()
        self._before = {name: os.environ.get(name) for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_LOG_DIR")}
        port = free_port()
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1",
                          ROS_LOG_DIR=str(self.folder))
        self._master = None
        if start:
            self.start_master()

    def start_master(self):
        """Start the master at its address, and wait for it."""
        self._master = self.start("rosmaster", "--core", "-p", self.uri.rpartition(":")[2])
        self.wait()

    def stop_master(self, how=signal.SIGKILL):
        """End the master, and nothing else."""
        self.stop(self._master, how)

    def wait(self):
        """Until the master answers."""
        wait_for_master(self.uri)

    def close(self):
        """End all, and forget the master."""
        super().close()
        for name, value in self._before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
