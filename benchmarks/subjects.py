"""What the driver's benchmarks measure: arrangements of the nodes, and the floor; how they start, their cost."""

import os
import re
import time
from pathlib import Path

from rig import Robot, SilenceError

from robotont_testing.robots import SHIPPED, robot_folder

ROOT = Path(__file__).resolve().parents[1]
FLOOR = "floor: a rospy process that only relays"
THREE = "three processes"
COMPOSED = "one process (composed)"
OURS = (THREE, COMPOSED)
NODES = {FLOOR: ("floor",), THREE: ("driver_node", "serial_com_node", "odom_node"), COMPOSED: ("robotont_node",)}
RATE = 50       # [Hz]
WARM_UP = 1.0   # [s]
QUIET = 0.4     # [s] after which nothing more is expected; less than the time-outs
WAYS = (("cmd_vel to wire", "commands"), ("wire to /odom", "feedback"))
COUNTED = ("sent", "lost", "overtaken", "repeated", "unexpected")  # of a Stream


class Subject:
    """Something that drives a robot of its own: one of OURS, or FLOOR."""

    def __init__(self, loop, processes, title, name):
        self.title = title
        self.name = name
        self.robot = Robot(loop, name, processes.uri, processes.folder)
        self._processes = processes
        self.log = processes.folder / (name + ".log")
        self.pids = []

    def start(self):
        """Start its processes; ours by a roslaunch, which starts the master too where there is none."""
        robot, processes = self.robot, self._processes
        if self.title == FLOOR:
            processes.start(ROOT / "benchmarks" / "floor_node.py", f"_port:={robot.port}",
                            log=self.log, ROS_NAMESPACE=self.name)
        else:
            without_limits = robot_folder(processes.folder / (robot.name + "_robot"), SHIPPED)
            processes.launch("robot.launch", f"namespace:={robot.name}", f"port:={robot.port}", "mux:=false",
                             "description:=false", f"composed:={str(self.title == COMPOSED).lower()}",
                             f"robot:={without_limits}", log=self.log)

    def connect(self):
        """Wait until it works both ways. Raises SilenceError with the end of what it printed."""
        try:
            self.robot.connect()
        except SilenceError as silence:
            raise SilenceError(f"{silence}; its output ends with:\n{self.log.read_text()[-2000:]}") from None
        self.pids = [self._processes.pid(f"/{self.name}/{node}") for node in NODES[self.title]]

    def processor(self):
        """[s] of processor time that its nodes have used so far."""
        return sum(map(processor_time, self.pids))

    def memory(self):
        """[MiB] proportional set size of its nodes."""
        return sum(map(memory, self.pids))


def measure(loop, subject, seconds):
    """Drive both ways at RATE; the robot's streams count what happens. Returns [s] of processor time per second."""
    _drive(loop, subject.robot, WARM_UP)
    subject.robot.begin()
    before, begin = subject.processor(), time.monotonic()
    _drive(loop, subject.robot, seconds)
    return (subject.processor() - before) / (time.monotonic() - begin)


def _drive(loop, robot, seconds):
    """Start, stop, and wait for what is under way as long as some of it comes."""
    robot.start(RATE)
    loop.run(seconds)
    loop.idle()
    streams = robot.commands, robot.feedback
    left = None
    while left != sum(stream.under_way for stream in streams):
        left = sum(stream.under_way for stream in streams)
        loop.run(QUIET, lambda: not any(stream.under_way for stream in streams))


def processor_time(pid):
    """[s] that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    """[MiB] proportional set size of a process."""
    return int(re.search(r"Pss:\s*(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text()).group(1)) / 1024
