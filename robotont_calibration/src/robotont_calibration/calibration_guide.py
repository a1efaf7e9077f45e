"""Guides through the runs of a calibration: announces each, drives it on Enter, records it, asks where it ended."""

import time
from pathlib import Path

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import Twist
from rostopic import get_topic_class
from std_msgs.msg import String

from robotont_calibration.calibration_runs import read_end
from robotont_calibration.recordings import Recording
from robotont_calibration.standard_drives import calibration_drives
from robotont_driver.parameters.files import write_file
from robotont_driver.robots.robot_folder import WHEELS, shipped
from robotont_driver.ros.server_parameters import running_wheels
from robotont_driver.rospy_repairs.rospy_process import init_tool

CONNECTING = 5.0  # [s] for the driver and the robot's packets
RESTING = 25      # packets in which no wheel gets an edge away: the robot stands; one may go to and fro
LONGEST_REST = 10.0  # [s] to wait for that
RESTLESS = f"For {LONGEST_REST:g} s the robot did not stand still, or sent no packets"


def guide(options, wheels):
    """Make the runs; list of RUN arguments for calibrate_wheels. Nothing moves before the user answers.

    Raises ValueError when no packets come, for another robot's wheels, or when no run was made; EOFError where nobody
    answers.
    """
    if "=" in options.guide:  # behind it stands a run's end
        raise ValueError(f"--guide: found {options.guide}, allowed: a folder without = in its name")
    folder = Path(options.guide)
    folder.mkdir(parents=True, exist_ok=True)
    init_tool("calibrate_wheels")
    made = []
    kept = folder / "runs.txt"  # of all sessions
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    topics = [f"--{name}={topic}" for name, topic in (("packets", options.packets), ("truth", options.truth)) if topic]
    runs = calibration_drives(wheels.pid_frequency, options.side, options.turns, options.line)
    print(f"{len(runs)} runs. Before each, mark where the robot's middle stands and where it looks, e.g. with tape.")
    robot = _Robot(options, wheels)
    if running_wheels(robot.namespace) != wheels:
        ours = shipped() / rospy.get_param(robot.namespace + "robot", "NAME")  # a path stays what it is
        raise ValueError(f"{options.wheel_params}: found other wheels than those of the running robot, allowed: "
                         f"--wheel-params {ours / WHEELS}; has that changed since the robot started, start it again")
    for number, (name, what, room, twists) in enumerate(runs, 1):
        print(f"\nRun {number} of {len(runs)}: {what}. It needs {room}.")
        try:
            run = _one_run(robot, _free(folder, name), list(twists))
        except KeyboardInterrupt:  # Ctrl-C at a question
            print()
            break
        if run == "q":
            break
        if run != "s":
            made.append(run)
            known = {line.partition("=")[0] for line in (*topics, run)}
            lines = [*topics, *(line for line in lines if line.partition("=")[0] not in known), run]
            write_file(kept, "\n".join(lines) + "\n")  # now: whatever comes, this run is kept
    if not made:
        raise ValueError("found no run to calibrate with")
    print(f"\nkept: {folder}/*.bag; with all complete runs of this folder: "
          f"calibrate_wheels --wheel-params ... @{kept}\n")
    return made


def _free(folder, name):
    """A file for a run; none that is there: it may be of an earlier session."""
    file, number = folder / f"{name}.bag", 1
    while file.exists():
        number += 1
        file = folder / f"{name}_{number}.bag"
    return file


def _one_run(robot, file, twists):
    """RUN argument of a run that was made and kept in a file; "s" to skip it, "q" to end."""
    while True:
        answer = input("Enter: the robot drives now, Ctrl-C stops it. s: skip this run. q: no more runs. ").strip()
        if answer in ("q", "s"):
            return answer
        why = robot.record(twists)
        if not why:
            return str(file) + robot.save(file)
        print(f"\n{why}. This run does not count; put the robot back on its mark.")


def ask_for_end():
    """X,Y,YAW as calibrate_wheels takes it behind a file; asks again until the answer is one."""
    while True:
        answer = input("Where does it stand now, seen from its mark? m forward, m to the left, degrees turned "
                       "counterclockwise, e.g. 0.03 -0.05 2: ")
        try:
            read_end(answer)
            return ",".join(answer.replace(",", " ").split())
        except ValueError as error:
            print(error)


class _Robot:
    """Interface to the robot: publishes commands; records packets and, optionally, true poses."""

    def __init__(self, options, wheels):
        self._frequency = wheels.pid_frequency
        self._recording, self._messages = Recording(), []  # these: (topic, message, when it came [s])
        # of the robot whose packets come: its wheels, and its commands, are there; with slashes around it
        self.namespace = rospy.resolve_name(options.packets).rpartition("/")[0] + "/"
        self._command = rospy.Publisher(self.namespace + "cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        kinds = {"packets": (options.packets, String)}
        if options.truth:
            kind = get_topic_class(rospy.resolve_name(options.truth))[0]
            if kind is None:
                raise ValueError(f"found no topic {options.truth}; is its node running?")
            kinds["truth"] = (options.truth, kind)
        for name, (topic, kind) in kinds.items():
            rospy.Subscriber(topic, kind, self._take, (name, topic), tcp_nodelay=True)
        until(lambda: len(self._recording.packets), CONNECTING, f"packets on {options.packets}")
        self._with_truth = "truth" in kinds

    def _take(self, message, source):
        now = rospy.get_time()
        self._recording.take(source[0], now, message)
        self._messages.append((source[1], message, now))

    def record(self, twists):
        """Drive a run and record it; returns why it does not count, "" when it does.

        Raises ValueError when nothing listens to the commands.
        """
        until(self._command.get_num_connections, CONNECTING,
              f"a node that takes commands on {self._command.resolved_name}")
        self._recording, self._messages = Recording(), []
        if not until(self._rests, LONGEST_REST):  # the first stamps are rough
            return RESTLESS
        try:
            self._drive(twists)
        except KeyboardInterrupt:
            return "Stopped by Ctrl-C"
        return "" if until(self._rests, LONGEST_REST) else RESTLESS

    def _drive(self, twists):
        message = Twist()
        begin = time.monotonic()
        try:
            for index, (message.linear.x, message.linear.y, message.angular.z) in enumerate(twists):
                self._command.publish(message)
                time.sleep(max(0.0, begin + (index + 1) / self._frequency - time.monotonic()))
        finally:
            self._command.publish(Twist())

    def _rests(self):
        newest = self._recording.packets[-RESTING:]
        ways = np.cumsum([counts for _, counts in newest], axis=0)
        return len(newest) == RESTING and np.ptp(ways, axis=0).max() <= 1.0

    def save(self, file):
        """Write the run; returns the suffix that calibrate_wheels expects after the file's name."""
        beside = file.with_suffix(".new")
        with rosbag.Bag(str(beside), "w") as bag:
            for topic, message, at in list(self._messages):
                bag.write(topic, message, rospy.Time.from_sec(at))
        write_file(file, beside.read_bytes())
        beside.unlink()
        if self._with_truth:
            return ""
        try:
            return "=" + ask_for_end()
        except KeyboardInterrupt:
            print(f"\nkept without its end: {file}. Measured later, it counts as RUN {file}=X,Y,YAW", end="")
            raise


def until(condition, seconds, needed=""):
    """Wait for a condition; whether it has come in time. Raises ValueError where it has not, of what is `needed`."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    if needed and not condition():
        raise ValueError(f"waited {seconds:g} s for {needed}; is the robot running?")
    return condition()
