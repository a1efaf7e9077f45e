"""One exercise, run: the simulator under a master of its own, the program in a process of its own, the true path."""

import contextlib
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rosgraph
import rospkg
import rospy
import yaml
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

from robotont_bringup.stack import StackError, scratch, stack
from robotont_course import judge
from robotont_description.geometry import robot_radius
from robotont_driver.kinematics import se2
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.world import read_world

PATIENCE = 10.0   # [s] for all that a program has started to end
SILENCE = 3.0     # [s] without the simulator's word, after which it is gone
OUTPUT = 10 ** 7  # [bytes] that a program may write into a file, and print
MEMORY = 6 * 2 ** 30  # [bytes] of addresses
MARK = "ROBOTONT_EXERCISE"  # in the environment of all that the program starts


def make_world(exercise, seed, folder):
    """The exercise's world with the start that belongs to a seed, and things in another order: its file."""
    bringup = Path(rospkg.RosPack().get_path("robotont_bringup"))
    content = yaml.safe_load((bringup / "config" / "worlds" / f"{exercise.world}.yaml").read_text())
    if seed:
        chance = np.random.default_rng(seed)
        moved = chance.uniform(-1, 1, 3) * exercise.spread
        content["start"] = [float(value) for value in np.add(content["start"], moved)]
        things = content.get("things", [])
        for thing, colour in zip(things, chance.permutation([thing[3] for thing in things])):
            thing[3] = str(colour)
    file = Path(folder) / "world.yaml"
    file.write_text(yaml.safe_dump(content))
    return file


def roslaunched(exercise, folder):
    """What roslaunch is to start for an exercise, with files in a folder."""
    launch = Path(rospkg.RosPack().get_path("robotont_bringup")) / "launch"
    words = [launch / "simulation.launch", f"port:={folder}/board", f"world:={folder}/world.yaml", "world_map:=true",
             "composed:=true", "mux:=false"]
    if exercise.camera:
        words += ["depth_camera:=true", *map("camera_{}:={}".format, ("width", "height"), exercise.camera)]
    return [*words, launch / "tags.launch", f"tag_size:={exercise.tags}"] if exercise.tags else words


class Witness:
    """Hears the truth, from the simulator alone, and the commands."""

    def __init__(self):
        self.rows = []           # of `judge.Run.path`, by the simulator's stamps
        self.heard = 0.0         # [s] on the steady clock: the newest
        self.commands = []       # (time, node, whether it is finite) of each
        self._subscribers = [rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, queue_size=500),
                             rospy.Subscriber("cmd_vel", Twist, self._on_command, queue_size=500)]

    def _on_truth(self, message):
        if message._connection_header["callerid"] != "/simulator_node":  # noqa: SLF001 rospy tells it nowhere else
            return
        twist = message.twist.twist
        self.heard = time.monotonic()
        self.rows.append((message.header.stamp.to_sec(), *se2.pose_of(message.pose.pose),
                          math.hypot(twist.linear.x, twist.linear.y), twist.angular.z))

    def _on_command(self, message):
        if self.rows and len(self.commands) <= 10 ** 5:
            values = message.linear.x, message.linear.y, message.angular.z
            self.commands.append((self.rows[-1][0], message._connection_header["callerid"],  # noqa: SLF001
                                  all(map(math.isfinite, values))))


def start_program(file, output):
    """The student's program in a process, a session and a folder of its own; no display, bounded files and memory.

    Its parent is a shell in that session: who ends the parent or its group ends nothing of ours.
    """
    bounds = ["sh", "-c", 'exec 3>&2 2>/dev/null; (exec "$@" 2>&3 3>&-); exit $?', "sh",  # which says nothing itself
              "prlimit", f"--fsize={OUTPUT}", f"--as={MEMORY}", "--core=0", "nice", "-n", "5"]
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment.update({MARK: output.name, "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1",
                        "HOME": str(output.parent)})
    with open(str(output), "wb") as stream:
        return subprocess.Popen([*bounds, sys.executable, str(Path(file).resolve())], cwd=str(output.parent),
                                env=environment, stdin=subprocess.DEVNULL, stdout=stream, stderr=subprocess.STDOUT,
                                start_new_session=True)


def has_ended(process):
    """Whether it has; its number stays its own."""
    return os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def end_program(process, name):
    """End it as Ctrl-C does, then it and all that it has started; a group at once, in which none can fork away."""
    os.killpg(process.pid, signal.SIGINT)  # its number is its own until `wait`
    asked = time.monotonic()
    while not has_ended(process) and time.monotonic() < asked + 2.0:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    absent, end = 0, time.monotonic() + PATIENCE  # looks in a row that found none: one that forks may hide behind one
    while absent < 2 and time.monotonic() < end:
        absent += 1
        for environment in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                if f"{MARK}={name}".encode() in environment.read_bytes().split(b"\0"):
                    os.killpg(os.getpgid(int(environment.parent.name)), signal.SIGKILL)
                    absent = 0
    process.wait()


def perform(exercise, file, seed):
    """(`judge.Run`, `judge.Program`, what it printed) of a program's run. Raises StackError."""
    with scratch() as folder:
        world = make_world(exercise, seed, folder)
        with stack(f"judge_{os.getpid()}", folder, *roslaunched(exercise, folder)) as wait_for:  # no program's name
            witness, pictures = Witness(), []
            wait_for(lambda: witness.rows, "the simulator")
            if exercise.camera:
                subscriber = rospy.Subscriber("camera/color/image_raw", Image, pictures.append, queue_size=1)
                wait_for(lambda: pictures, "the camera's picture")
                subscriber.unregister()
            wait_for(lambda: "/robotont_node" in graph()[1].get("/cmd_vel", []) and witness.rows[-1][4] < judge.STILL,
                     "the driver, and the robot to stand")
            return play(exercise, file, read_world(world), witness, Path(folder))


def graph():
    """Who publishes, subscribes and serves: {name: nodes} of each."""
    return [dict(part) for part in rosgraph.Master("/exercise").getSystemState()]


def play(exercise, file, world, witness, folder):
    """Let the program drive until it has done it, has touched something, has ended, or the time is over.

    As `perform`. Raises StackError where the simulator falls silent, unless the program has taken a node's name.
    """
    radius, output, robots = robot_radius(read_robot().wheels), folder / f"output_{os.getpid()}", nodes()
    process = start_program(file, output)
    first, ended, topics, silent = len(witness.rows) - 1, math.inf, (), False
    begin = witness.rows[first][0]

    def so_far():
        return judge.Run(np.array(witness.rows[first:]) - (begin, 0, 0, 0, 0, 0), world, radius)
    try:
        run = so_far()
        while not (run.end >= exercise.limit or judge.touch(run) or judge.reached(exercise, run) or silent
                   or (run.end > ended + 1.0 and judge.stands_for(run) > 0.5)):
            time.sleep(0.2)
            if not witness.commands:
                with contextlib.suppress(OSError):  # the master has gone, with a simulator whose name was taken
                    topics = published(robots) or topics
            run = so_far()
            if has_ended(process):
                ended = min(ended, run.end)
            silent = time.monotonic() - witness.heard > SILENCE
        over = has_ended(process)
    finally:
        end_program(process, output.name)
    printed = end_of(output, 20000)
    taken = robots & {*re.findall(r"\[(/\S+)\] Reason: new node registered with same name",
                                  end_of(folder / "stack.log", OUTPUT) + printed)}
    if silent and not taken:
        raise StackError(f"the simulator has said nothing for {SILENCE:g} s")
    status, error = process.returncode if over else None, where(printed, file)
    if output.exists() and output.stat().st_size >= OUTPUT:
        error = f"it printed more than {OUTPUT // 10 ** 6} MB"
    commands = tuple((second - begin, node, finite) for second, node, finite in witness.commands)
    program = judge.Program(commands, status, error if status else "", ended, topics, ", ".join(sorted(taken)))
    return run, program, printed


def end_of(file, most):
    """The end of a text file, up to `most` characters; nothing where the program has removed it."""
    return file.read_text(errors="replace")[-most:] if file.is_file() else ""


def nodes():
    """The names of all nodes."""
    return {node for part in graph() for found in part.values() for node in found}


def published(robots):
    """What other nodes than the robot's publish, with the types, but for where commands belong."""
    types = dict(rosgraph.Master("/exercise").getTopicTypes())
    return tuple(f"{topic} ({types.get(topic)})" for topic, found in graph()[0].items()
                 if topic != "/rosout" and (topic, types.get(topic)) != ("/cmd_vel", "geometry_msgs/Twist")
                 and not robots.issuperset(found))


def where(printed, file):
    """The last line of a traceback, with the line of the student's file."""
    numbers = re.findall(f'{re.escape(Path(file).name)}", line (\\d+)', printed)
    return (f"line {numbers[-1]}: " if numbers else "") + (printed.strip().splitlines() or [""])[-1][:200]
