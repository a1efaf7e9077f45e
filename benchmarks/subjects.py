"""What the driver's benchmarks measure: arrangements of the nodes, the floor and peers; how they start, their cost."""

import os
import re
import shlex
import time
import xmlrpc.client
from pathlib import Path

from rig import CALLER, Robot, SilenceError

from robotont_testing import places
from robotont_testing.robots import SHIPPED

ROOT = Path(__file__).resolve().parents[1]
FLOOR = "floor: a rospy process that only relays"
THREE = "three processes"
COMPOSED = "one process (composed)"
COMPONENTS = "mux:=false", "description:=false"  # the driver alone
RATE = 50       # [Hz]
WARM_UP = 1.0   # [s]
QUIET = 0.4     # [s] after which nothing more is expected; less than the time-outs
WAYS = (("cmd_vel to wire", "commands"), ("wire to /odom", "feedback"))
COUNTED = ("sent", "lost", "overtaken", "repeated", "unexpected")  # of a Stream


def arrangements():
    """Titles of the ways in which robot.launch can start the driver, the best last."""
    composable = '<arg name="composed"' in places.launch("robot.launch").read_text()
    return [THREE, COMPOSED] if composable else [THREE]


def title_of(what):
    """How the tables call a subject: the part of a peer's text that stands before its command, if any."""
    return what if what == FLOOR else what.rpartition(": ")[0] or what


def launch_arguments(robot, arrangement):
    """Arguments of robot.launch for the driver alone."""
    composed = [f"composed:={str(arrangement == COMPOSED).lower()}"] if COMPOSED in arrangements() else []
    return [f"namespace:={robot.name}", f"port:={robot.port}", f"robot:={robot.folder}",
            *COMPONENTS, *composed]


class Subject:
    """Something that drives a robot of its own: one of arrangements(), FLOOR, or a peer (a string, see run.py -h)."""

    def __init__(self, loop, processes, what, name, parameters=SHIPPED, peer_board="plain"):
        self.title, self._command = title_of(what), what.rpartition(": ")[2]
        self.name = name
        self.is_peer = what not in (FLOOR, *arrangements())
        board = peer_board if self.is_peer else "checked"
        self.robot = Robot(loop, name, processes.uri, processes.folder, parameters, board)
        self._parameters = parameters
        self._processes = processes
        self.log = processes.folder / (name + ".log")
        self.pids = []

    def start(self):
        """Start its processes; ours by a roslaunch, which starts the master too where there is none."""
        robot, processes = self.robot, self._processes
        if self.title == FLOOR:
            processes.start(ROOT / "benchmarks" / "floor_node.py", f"_port:={robot.port}",
                            log=self.log, ROS_NAMESPACE=self.name)
        elif self.is_peer:
            xmlrpc.client.ServerProxy(processes.uri).setParam(CALLER, "/" + self.name, self._parameters)
            words = shlex.split(self._command.format(port=robot.port, namespace=self.name))
            processes.start(*words, log=self.log, ROS_NAMESPACE=self.name)
        else:
            processes.launch("robot.launch", *launch_arguments(robot, self.title), log=self.log)

    def connect(self):
        """Wait until it works both ways. Raises SilenceError with the end of what it printed."""
        try:
            self.robot.connect()
        except SilenceError as silence:
            raise SilenceError(f"{silence}; its output ends with:\n{self.log.read_text()[-2000:]}") from None
        self.pids = pids_below(self.robot.uri, self.name)

    def processor(self):
        """[s] of processor time that its nodes have used so far."""
        return sum(map(processor_time, self.pids))

    def memory(self):
        """[MiB] proportional set size of its nodes."""
        return sum(map(memory, self.pids))


def measure(loop, subjects, rate, seconds):
    """Drive both ways at a rate [Hz], all at evenly spread moments; the robots' streams count what happens.

    Returns [s] of processor time per second of all together.
    """
    robots = [subject.robot for subject in subjects]
    _drive(loop, robots, rate, WARM_UP)
    for robot in robots:
        robot.begin()
    before, begin = sum(subject.processor() for subject in subjects), time.monotonic()
    _drive(loop, robots, rate, seconds)
    elapsed = time.monotonic() - begin
    return (sum(subject.processor() for subject in subjects) - before) / elapsed


def _drive(loop, robots, rate, seconds):
    """Start, stop, and wait for what is under way as long as some of it comes."""
    for number, robot in enumerate(robots):
        robot.start(rate, number / len(robots))
    loop.run(seconds)
    loop.idle()
    streams = [stream for robot in robots for stream in (robot.commands, robot.feedback)]
    left = None
    while left != sum(stream.under_way for stream in streams):
        left = sum(stream.under_way for stream in streams)
        loop.run(QUIET, lambda: not any(stream.under_way for stream in streams))


def pids_below(uri, namespace):
    """Process ids of the nodes in a namespace."""
    nodes = set()
    for kind in xmlrpc.client.ServerProxy(uri).getSystemState(CALLER)[2]:
        for _, names in kind:
            nodes.update(name for name in names if name.startswith(f"/{namespace}/"))
    return sorted({pid_of(uri, node) for node in nodes})


def pid_of(uri, node):
    """Process id of a node."""
    code, words, address = xmlrpc.client.ServerProxy(uri).lookupNode(CALLER, node)
    if code != 1:
        raise SilenceError(words)
    return xmlrpc.client.ServerProxy(address).getPid(CALLER)[2]


def processor_time(pid):
    """[s] that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    """[MiB] proportional set size of a process."""
    return int(re.search(r"Pss:\s*(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text()).group(1)) / 1024
