"""The driver at work without a robot: a square and a turning circle, figures, and a picture.

Starts the stack on the simulator or, with --ideal, on a board with ideal motors, in both cases behind a serial
line that spoils some bytes; drives by cmd_vel, and compares odom with where the robot really is (--ideal: with
the path that its wheels really made). Exit status 0 only when the end pose is right within the bounds.
"""

import argparse
import math
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32

from robotont_driver.kinematics import Kinematics
from robotont_driver.odometry import Pose
from robotont_driver.se2 import pose_of, yaw_of
from robotont_driver.wheels import read_wheels
from robotont_testing.harness import Master, wait_for
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board

PERIOD = 0.02                        # [s] between commands
SPEED = 0.4                          # [m/s]
SIDE, RADIUS = 1.0, 0.5              # [m]


def plan():
    """Yields (leg, twist) for each period: a square without turning, then a circle with one turn."""
    side = round(SIDE / SPEED / PERIOD)
    for leg, (x, y) in (("forward", (1, 0)), ("left", (0, 1)), ("back", (-1, 0)), ("right", (0, -1))):
        for _ in range(side):
            yield f"square, {leg}", (x * SPEED, y * SPEED, 0.0)
    circle = round(2 * math.pi * RADIUS / SPEED / PERIOD)
    turn = 2 * math.pi / (circle * PERIOD)
    for step in range(circle):
        # straight on in the room while the robot turns the other way: the direction goes round twice
        yield "circle, turning", (SPEED * math.cos(2 * turn * step * PERIOD),
                                  SPEED * math.sin(2 * turn * step * PERIOD), -turn)


class Ideal:
    """A board with ideal motors. Truth: the path that the wheels really make, fractions of edges included."""

    name = "a board with ideal motors"
    LARGEST_ERROR = (1e-3, math.radians(0.1))  # [m], [rad] at the end

    def __init__(self, master, kinematics, bad_bytes):
        self._to_step = kinematics.inverse * np.array(kinematics.wheels.metres_per_edge)
        self._turned = np.zeros(kinematics.wheels.amount)
        self._pose = Pose()
        self.path = [(0.0, 0.0)]
        self._times = [time.time()]
        self.arrivals = []
        self.board = Board(str(master.folder / "board"))
        self.board.line.corrupt = bad_bytes
        self.board.on_period = self._on_period
        self.board.on_bytes = lambda now, _: self.arrivals.append(now)
        self.board.plug()
        self.log = master.folder / "log"
        master.launch("robot.launch", f"port:={self.board.link}", log=self.log)

    def connect(self):
        """Nothing to connect: the board lives in this process."""

    def pose(self):
        """True (x [m], y [m], yaw [rad])."""
        return self._pose.x, self._pose.y, self._pose.yaw

    def stands(self):
        """Whether the wheels stand."""
        return not any(self.board.speeds)

    def distances(self, odom):
        """[mm] of odometry messages from the true place at the same time."""
        return distances(odom, self._times, self.path)

    def figures(self, published):
        """Rows that only this board can give."""
        arrivals = np.array(self.arrivals)
        latency = sorted((arrivals[index] - sent) * 1000 for sent in published
                         for index in [np.searchsorted(arrivals, sent)] if index < len(arrivals))
        return [
            ("packets to the board", len(self.board.heard)),
            ("packets from the board", len(self.board.told)),
            ("command to board, median", f"{latency[len(latency) // 2]:.2f} ms"),
            ("command to board, 99 %", f"{latency[int(0.99 * len(latency))]:.2f} ms"),
        ]

    def close(self):
        """Unplug."""
        self.board.unplug()

    def _on_period(self, turned):
        turned = np.array(turned)
        self._pose.move((self._to_step @ (turned - self._turned)).tolist(), np.zeros((3, 3)))
        self._turned = turned
        self._times.append(time.time())
        self.path.append((self._pose.x, self._pose.y))


class Simulated:
    """The simulator. Truth: where its robot stands; wheels slip a little, and the odometry cannot know."""

    name = "the simulator"
    LARGEST_ERROR = (0.03, math.radians(2.0))  # [m], [rad] at the end

    def __init__(self, master, _kinematics, bad_bytes):
        self.path = []
        self._times = []
        self._truth = None
        self._bad_bytes = bad_bytes
        self.log = master.folder / "log"
        master.launch("simulation.launch", f"port:={master.folder / 'board'}", log=self.log)

    def connect(self):
        """Listen to the ground truth, spoil the line."""
        rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, tcp_nodelay=True)
        self._errors = rospy.Publisher("simulator_node/byte_errors", Float32, queue_size=1, latch=True)
        self._errors.publish(self._bad_bytes)

    def _on_truth(self, message):
        self._truth = message
        self._times.append(seconds(message))
        self.path.append(self.pose()[:2])

    def pose(self):
        """True (x [m], y [m], yaw [rad])."""
        pose = self._truth.pose.pose
        return pose_of(pose)

    def stands(self):
        """Whether the robot stands."""
        twist = self._truth.twist.twist
        return max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z)) < 2e-3

    def distances(self, odom):
        """[mm] of odometry messages from the true place at the same time."""
        return distances(odom, self._times, self.path)

    def figures(self, _published):
        """Rows that only the simulator can give: none."""
        return []

    def close(self):
        """Nothing to close."""


def places(odom):
    """N x 2, [m], of odometry messages."""
    return np.array([(message.pose.pose.position.x, message.pose.pose.position.y) for message in odom])


def distances(odom, times, path):
    """N, [mm], of odometry messages from a path (K x 2 [m]) at the same `times` (K [s])."""
    number = min(len(times), len(path))  # a subscriber's thread may be adding to both
    x, y = (np.interp([seconds(message) for message in odom], times[:number], axis) for axis in np.array(path[:number]).T)
    return 1000 * np.hypot(*(places(odom) - np.column_stack([x, y])).T)


def seconds(message):
    """[s] of a message's stamp."""
    return message.header.stamp.to_sec()


class Demo:
    """The stack, the robot and all that is recorded."""

    def __init__(self, master, kind, bad_bytes):
        wheels = read_wheels(SHIPPED)
        self.kinematics = Kinematics(wheels)
        self.robot = kind(master, self.kinematics, bad_bytes)
        self.published = []
        self.odom, self.commanded = [], Pose()
        self.command_path = [(0.0, 0.0)]
        self.link, self.joints = {}, ()
        rospy.init_node("demo", disable_signals=True)
        rospy.Subscriber("odom", Odometry, self.odom.append, tcp_nodelay=True)
        rospy.Subscriber("joint_states", JointState, self._on_joints, tcp_nodelay=True)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)
        self.publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self.robot.connect()

    def _on_joints(self, message):
        self.joints = message.position

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}

    def drive(self):
        """Follow the plan, then stop and wait until every count has arrived."""
        wait_for(lambda: self.odom and self.robot.path and self.publisher.get_num_connections(), "the stack")
        legs = list(plan())
        due = time.monotonic()
        for number, (leg, speeds) in enumerate(legs, 1):
            self.command(speeds)
            self.commanded.move([speed * PERIOD for speed in speeds], np.zeros((3, 3)))
            self.command_path.append((self.commanded.x, self.commanded.y))
            if number == len(legs) or legs[number][0] != leg or (number % 10 == 0 and sys.stdout.isatty()):
                show_progress(number / len(legs), leg)
            due += PERIOD
            time.sleep(max(0.0, due - time.monotonic()))
        wait_for(lambda: self.command((0.0, 0.0, 0.0)) or self.robot.stands(), "the robot to stop", period=PERIOD)
        still = self.joints
        wait_for(lambda: self.joints is not still and self.settled(), "the last counts", period=0.1)
        told = self.link
        wait_for(lambda: self.link is not told, "the newest diagnostics")

    def settled(self):
        """Whether the odometry has every count: the wheels' angles stay the same."""
        before, self._angles = getattr(self, "_angles", None), self.joints
        return before == self.joints

    def command(self, speeds):
        """Publish a twist and keep when."""
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = speeds
        self.published.append(time.monotonic())
        self.publisher.publish(message)

    def error(self):
        """([m], [rad]) between odometry and truth, now."""
        pose, truth = self.odom[-1].pose.pose, self.robot.pose()
        yaw = yaw_of(pose.orientation)
        return (math.hypot(pose.position.x - truth[0], pose.position.y - truth[1]),
                abs(math.remainder(yaw - truth[2], 2 * math.pi)))

    def figures(self):
        """Rows (what, value) of the closing table."""
        metres, radians = self.error()
        allowed = self.robot.LARGEST_ERROR
        return [
            ("commands published", len(self.published)),
            *self.robot.figures(self.published),
            ("packets written to the line", self.link["packets written"]),
            ("packets published on serial_read", self.link["packets read"]),
            ("  lines spoilt on the way, and dropped", self.link["lines dropped"]),
            ("  periods repaired from the totals", self.link["periods repaired"]),
            ("end pose, odometry against truth", f"{metres * 1000:.2f} mm, {math.degrees(radians):.3f} deg"),
            ("  allowed", f"{allowed[0] * 1000:g} mm, {math.degrees(allowed[1]):g} deg"),
        ]


def show_progress(part, leg):
    """One line that grows, on a terminal; a line for each leg elsewhere."""
    bar = "#" * round(30 * part)
    text = f"  [{bar:<30}] {100 * part:3.0f} %  {leg:<20}"
    print("\r" + text if sys.stdout.isatty() else text, end="" if sys.stdout.isatty() else "\n", flush=True)
    if part >= 1 and sys.stdout.isatty():
        print()


def draw(demo, file):
    """The picture: the three paths, and how far odometry is from the truth on the way."""
    odom = places(demo.odom)
    truth, command = np.array(demo.robot.path), np.array(demo.command_path)
    allowed = 1000 * demo.robot.LARGEST_ERROR[0]
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.2), gridspec_kw={"width_ratios": (1.25, 1)})
    left.plot(*truth.T, color="#b8d4e8", linewidth=7, solid_capstyle="round", label="truth")
    left.plot(*command.T, color="#7a7a7a", linewidth=1.2, linestyle=(0, (4, 3)), label="command: cmd_vel")
    left.plot(*odom.T, color="#1f4e79", linewidth=1.6, label="odometry: odom")
    for message in demo.odom[::60]:
        pose = message.pose.pose
        yaw = yaw_of(pose.orientation)
        left.arrow(pose.position.x, pose.position.y, 0.07 * math.cos(yaw), 0.07 * math.sin(yaw), width=0.006,
                   head_width=0.03, color="#1f4e79", length_includes_head=True)
    left.plot(0, 0, "o", color="#2e7d32", markersize=8, label="start")
    left.set_aspect("equal", adjustable="datalim")
    left.set(xlabel="x [m]", ylabel="y [m]", title="A square, then a circle while turning")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncol=4, fontsize=8, frameon=False)
    messages = list(demo.odom)
    times = np.array([seconds(message) for message in messages])
    right.plot(times - times[0], demo.robot.distances(messages), color="#1f4e79", linewidth=0.9)
    right.axhline(allowed, color="#9e9e9e", linestyle=":", label="allowed at the end")
    right.set(xlabel="time [s]", ylabel="distance from the truth [mm]", ylim=(0, 1.1 * allowed),
              title="Odometry against truth")
    right.legend(loc="upper right", fontsize=8)
    for axes in (left, right):
        axes.grid(color="#e6e6e6")
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(str(file), dpi=110)


def main():
    """Run the demo; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", default="demo.png", help="where to put the picture [%(default)s]")
    parser.add_argument("--bad-bytes", type=float, default=0.001, metavar="RATE",
                        help="share of the board's bytes that the line spoils [%(default)s]")
    parser.add_argument("--ideal", action="store_true", help="ideal motors instead of the simulator")
    options = parser.parse_args()
    if not 0.0 <= options.bad_bytes <= 0.05:
        parser.error(f"--bad-bytes: found {options.bad_bytes}, allowed: 0 to 0.05")
    kind = Ideal if options.ideal else Simulated
    print(f"driving {kind.name}: a square of 1 m, then a circle while turning")
    with Master() as master:
        demo = Demo(master, kind, options.bad_bytes)
        try:
            demo.drive()
        except AssertionError as error:
            print(f"the demo failed: {error}; the stack said:\n{demo.robot.log.read_text()}", file=sys.stderr)
            return 1
        for what, value in demo.figures():
            print(f"  {what:<42} {value}")
        demo.robot.close()
        draw(demo, options.picture)
    print(f"picture: {options.picture}")
    good = all(found < allowed for found, allowed in zip(demo.error(), kind.LARGEST_ERROR))
    if not good:
        print("the end pose is outside the bounds", file=sys.stderr)
    return 0 if good else 1

