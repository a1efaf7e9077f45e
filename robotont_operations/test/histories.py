"""A robot and its commanders, on two machines; each motion of the board tells its own age."""

import contextlib
import os
import signal
import subprocess

import numpy as np

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing import places
from robotont_testing.harness import suspend, wait_for
from robotont_testing.robots import SHIPPED, robot_folder
from robotont_testing.stand_in_board import Board
from robotont_testing.two_machines import ADDRESSES, TwoMachines

TIMEOUT = 0.5              # [s] cmd_timeout
SLACK = 0.1                # [s] of this machine: scheduling, and the resolution of the stamps
ALLOWED = TIMEOUT + SLACK  # [s]
TICK, WRAP = 0.02, 2000    # [s], number of stamps: ages up to 40 s
# (v_x, v_y, omega) of stamp 0 and of each tick, for each commander; no two alike in direction
MOTIONS = (((0.1, 0, 0), (0.0006, 0, 0)), ((0, 0.1, 0), (0, 0.0006, 0)), ((0, 0, 0.5), (0, 0, 0.004)))
LATCHED = 2

# Does what the word in the file argv[4] says: drive (at 20 Hz), once, or press: the emergency stop.
COMMANDER = f"""
import sys, time, rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool
topic, first, step, orders, latch = sys.argv[1], eval(sys.argv[2]), eval(sys.argv[3]), sys.argv[4], sys.argv[5]
rospy.init_node("commander", anonymous=True, disable_signals=True)
class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, topic, *_):
        print("can press" if topic == "/emergency_stop" else "connected", flush=True)
publisher = rospy.Publisher(topic, Twist, Listener(), tcp_nodelay=True, latch=latch == "True", queue_size=1)
def publish():
    begun = time.monotonic()
    stamp = int(begun / {TICK}) % {WRAP}
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = (a + b * stamp for a, b in zip(first, step))
    publisher.publish(message)
    if time.monotonic() - begun > {SLACK} / 2:
        print("late", stamp, flush=True)
stop = rospy.Publisher("emergency_stop", Bool, Listener(), queue_size=1)
before = ""
while True:
    order = open(orders).read()
    if order == "press" != before:
        stop.publish(True)
    if order in ("drive", "press") or order == "once" != before:
        publish()
    before = order
    time.sleep(0.05)
"""


class Stamps:
    """Which commander's motion a packet carries, and how old it is."""

    def __init__(self):
        self._kinematics = Kinematics(read_wheels(SHIPPED))

    def read(self, line, now):
        """(commander, age [s]) of the motion in a packet heard at `now`; None for a stop."""
        units = [float(field) for field in line.partition(";")[0].split(":")]
        if not any(units):
            return None
        twist = self._kinematics.inverse @ (units / self._kinematics.units_per_speed)
        rates = [np.dot(twist, step) / np.dot(step, step) for _, step in MOTIONS]  # [stamps] and more
        errors = [np.linalg.norm(twist - rate * np.array(step)) if rate > 0 else np.inf
                  for rate, (_, step) in zip(rates, MOTIONS)]
        who = int(np.argmin(errors))
        first, step = MOTIONS[who]
        stamp = np.dot(twist - np.array(first), step) / np.dot(step, step)
        return who, ((now / TICK - stamp + 5) % WRAP - 5) * TICK


class Stage(TwoMachines):
    """robot.launch on the robot, a board at its port, and commanders on either machine.

    master: the machine that has the ROS master.
    """

    def __init__(self, mux=True, master="robot"):
        super().__init__()
        self.mux = mux
        self.master = master
        self.topic = "cmd_vel/hand" if mux else "cmd_vel"
        self.board = Board(str(self.folder / "board"), checked=True)
        self.board.plug()
        self._stamps = Stamps()
        self._read = 0
        self._commanders = {}
        self._stopped = set()
        self._dropping = False
        folder = robot_folder(self.folder / "robot", SHIPPED)  # without limits: each motion is as it was commanded
        if master != "robot":
            self.on(master, "roscore", **self._environment(master))
        self.robot = self.on("robot", "roslaunch", *([] if master == "robot" else ["--wait"]),
                             places.launch("robot.launch"), f"port:={self.board.link}", f"robot:={folder}",
                             f"mux:={str(mux).lower()}", "description:=false", log=self.folder / "robot.log",
                             **self._environment("robot"))
        wait_for(lambda: self.pid("driver_node"), "the robot", timeout=60)

    def _environment(self, machine):
        return {"ROS_MASTER_URI": f"http://{ADDRESSES[self.master]}:11311", "ROS_IP": ADDRESSES[machine],
                "ROS_LOG_DIR": str(self.folder)}

    def close(self):
        self.resume()
        self.board.close()
        super().close()

    def pid(self, name):
        """Process id of a process of robot.launch by its program's name; 0: it does not run now."""
        found = subprocess.run(["pgrep", "--parent", str(self.robot.pid), "--full", f"/{name}( |$)"], check=False,
                               text=True, stdout=subprocess.PIPE).stdout.split()
        return int(found[0]) if found else 0

    def command(self, who, order, machine="laptop", latch=False):
        """Let commander `who` drive, publish once or press; it starts where it does not run."""
        file = self.folder / f"orders.{who}"
        file.write_text(order)
        if who not in self._commanders:
            self._commanders[who] = self.on(
                machine, "/usr/bin/python3", "-c", COMMANDER, self.topic, *MOTIONS[who], file, latch,
                log=self.folder / f"commander.{who}.log", **self._environment(machine))

    def commander_log(self, who):
        """What a commander has printed: "connected" for each subscriber."""
        return (self.folder / f"commander.{who}.log").read_text()

    def release(self):
        self.check("robot", "rosservice", "call", "/emergency_stop/release")

    def drop(self):
        """The network loses everything from the laptop, and nobody notices, until `mend`."""
        self.block("robot", f"ip saddr {ADDRESSES['laptop']}")
        self._dropping = True

    def mend(self):
        super().mend()
        if self._dropping:
            self.open_firewall("robot")
            self._dropping = False

    def kill(self, who, how=signal.SIGKILL):
        process = self._commanders.pop(who, None)
        if process:
            self._stopped.discard(process.pid)
            self.stop(process, how)

    def hang(self, who):
        """A commander, or a program of robot.launch, stands until `resume`."""
        pid = self._commanders[who].pid if who in self._commanders else self.pid(who)
        suspend(pid)
        self._stopped.add(pid)

    def resume(self):
        for pid in self._stopped:
            with contextlib.suppress(ProcessLookupError):  # it was killed meanwhile
                os.kill(pid, signal.SIGCONT)
        self._stopped.clear()

    def respawn(self, name):
        os.kill(self.pid(name), signal.SIGKILL)

    def motions(self):
        """(commander, age [s]) of each motion that the board has heard since the last call."""
        heard = self.board.heard[self._read:]
        self._read += len(heard)
        read = [(at, self._stamps.read(line, at)) for at, line in heard if line and line[0] in "-0123456789"]
        return [motion for at, motion in read if motion and not self._left_late(*motion, at)]

    def _left_late(self, who, age, at):
        """Whether an old command has left its commander old, which hung between making and sending it."""
        stamps = (str(round((at - age) / TICK) % WRAP + off) for off in (-1, 0, 1))
        return age > ALLOWED and any(f"late {stamp}\n" in self.commander_log(who) for stamp in stamps)

    def drives(self, who):
        try:
            wait_for(lambda: any(one == who and age < ALLOWED for one, age in self.motions()), f"motion by {who}", 60.0)
        except AssertionError:
            print((self.folder / "robot.log").read_text()[-5000:], self.commander_log(who), flush=True)
            raise
