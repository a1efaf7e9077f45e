"""The driver at work without a robot: a square and a turning circle, figures, and a picture.

Starts the stack against a board that is not there (ideal motors behind a pseudo-terminal, on a line that
spoils some bytes), drives by cmd_vel, and compares odom with the path that the wheels really made.
Exit status 0 only when the end pose is right within the bounds.
"""

import argparse
import math
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "robotont_driver" / "test"))

import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
import rospy  # noqa: E402
import yaml  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import Twist  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from board import Board  # noqa: E402
from harness import Master, wait_for  # noqa: E402
from robotont_driver.kinematics import Kinematics  # noqa: E402
from robotont_driver.odometry import Pose  # noqa: E402
from robotont_driver.wheels import read_wheels  # noqa: E402

PERIOD = 0.02                        # [s] between commands
SPEED = 0.4                          # [m/s]
SIDE, RADIUS = 1.0, 0.5              # [m]
LARGEST_ERROR = (1e-3, math.radians(0.1))  # [m], [rad] at the end


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


class Truth:
    """The path that the wheels really make, fractions of edges included."""

    def __init__(self, kinematics):
        self._to_step = kinematics.inverse * np.array(kinematics.wheels.metres_per_edge)
        self._turned = np.zeros(kinematics.wheels.amount)
        self.pose = Pose()
        self.path = [(0.0, 0.0)]

    def on_period(self, turned):
        """Take the edges that each wheel has turned since the start."""
        turned = np.array(turned)
        self.pose.move((self._to_step @ (turned - self._turned)).tolist(), np.zeros((3, 3)))
        self._turned = turned
        self.path.append((self.pose.x, self.pose.y))


class Demo:
    """The stack, the board and all that is recorded."""

    def __init__(self, master, bad_bytes):
        wheels = read_wheels(yaml.safe_load((ROOT / "config" / "wheel_params.yaml").read_text()))
        self.kinematics = Kinematics(wheels)
        self.truth = Truth(self.kinematics)
        self.board = Board(str(master.folder / "board"))
        self.board.line.corrupt = bad_bytes
        self.board.on_period = self.truth.on_period
        self.board.on_bytes = lambda now, _: self.arrivals.append(now)
        self.arrivals, self.published = [], []
        self.odom, self.commanded = [], Pose()
        self.command_path = [(0.0, 0.0)]
        self.link, self.joints = {}, ()
        self.log = master.folder / "log"
        master.launch("robot.launch", f"port:={self.board.link}", log=self.log)
        rospy.init_node("demo", disable_signals=True)
        rospy.Subscriber("odom", Odometry, self.odom.append, tcp_nodelay=True)
        rospy.Subscriber("joint_states", JointState, self._on_joints, tcp_nodelay=True)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)
        self.publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def _on_joints(self, message):
        self.joints = message.position

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}

    def drive(self):
        """Follow the plan, then stop and wait until every count has arrived."""
        wait_for(lambda: self.odom and self.publisher.get_num_connections(), "the stack")
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
        self.command((0.0, 0.0, 0.0))
        wait_for(lambda: not any(self.board.speeds), "the robot to stop")
        per_edge = 2 * math.pi / self.kinematics.wheels.edges_per_turn
        wait_for(lambda: all(abs(angle - counted * per_edge) < 1e-6
                             for angle, counted in zip(self.joints, self.board.motors.counted)), "the last counts")
        told = self.link
        wait_for(lambda: self.link is not told, "the newest diagnostics")

    def command(self, speeds):
        """Publish a twist and keep when."""
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = speeds
        self.published.append(time.monotonic())
        self.publisher.publish(message)

    def error(self):
        """([m], [rad]) between odometry and truth, now."""
        pose, truth = self.odom[-1].pose.pose, self.truth.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        return (math.hypot(pose.position.x - truth.x, pose.position.y - truth.y),
                abs(math.remainder(yaw - truth.yaw, 2 * math.pi)))

    def latencies(self):
        """[ms] from each command to the first bytes that the board heard after it."""
        arrivals = np.array(self.arrivals)
        return [(arrivals[index] - sent) * 1000 for sent in self.published
                for index in [np.searchsorted(arrivals, sent)] if index < len(arrivals)]

    def figures(self):
        """Rows (what, value) of the closing table."""
        latency = sorted(self.latencies())
        metres, radians = self.error()
        return [
            ("commands published", len(self.published)),
            ("packets to the board", len(self.board.heard)),
            ("packets from the board", len(self.board.told)),
            ("  lines spoilt on the way, and dropped", self.link["lines dropped"]),
            ("  periods repaired from the totals", self.link["periods repaired"]),
            ("  packets published", self.link["packets read"]),
            ("command to board, median", f"{latency[len(latency) // 2]:.2f} ms"),
            ("command to board, 99 %", f"{latency[int(0.99 * len(latency))]:.2f} ms"),
            ("end pose, odometry against truth", f"{metres * 1000:.3f} mm, {math.degrees(radians):.4f} deg"),
            ("  allowed", f"{LARGEST_ERROR[0] * 1000:g} mm, {math.degrees(LARGEST_ERROR[1]):g} deg"),
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
    odom = np.array([(message.pose.pose.position.x, message.pose.pose.position.y) for message in demo.odom])
    truth, command = np.array(demo.truth.path), np.array(demo.command_path)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.2), gridspec_kw={"width_ratios": (1.25, 1)})
    left.plot(*truth.T, color="#b8d4e8", linewidth=7, solid_capstyle="round", label="truth: what the wheels did")
    left.plot(*command.T, color="#7a7a7a", linewidth=1.2, linestyle=(0, (4, 3)), label="command: cmd_vel")
    left.plot(*odom.T, color="#1f4e79", linewidth=1.6, label="odometry: odom")
    for message in demo.odom[::60]:
        pose = message.pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        left.arrow(pose.position.x, pose.position.y, 0.07 * math.cos(yaw), 0.07 * math.sin(yaw), width=0.006,
                   head_width=0.03, color="#1f4e79", length_includes_head=True)
    left.plot(0, 0, "o", color="#2e7d32", markersize=8, label="start")
    left.set_aspect("equal", adjustable="datalim")
    left.set(xlabel="x [m]", ylabel="y [m]", title="A square, then a circle while turning")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncol=4, fontsize=8, frameon=False)
    # the nearest point of the true path, since messages and periods have no common clock
    distance = [1000 * np.min(np.hypot(*(truth - point).T)) for point in odom]
    right.plot(np.arange(len(distance)) * PERIOD, distance, color="#1f4e79", linewidth=0.9)
    right.axhline(1000 * LARGEST_ERROR[0], color="#9e9e9e", linestyle=":", label="allowed at the end")
    right.set(xlabel="time [s]", ylabel="distance from the true path [mm]", ylim=(0, 1.1),
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
    parser.add_argument("--picture", default=str(ROOT / "demo.png"), help="where to put the picture [%(default)s]")
    parser.add_argument("--bad-bytes", type=float, default=0.001, metavar="RATE",
                        help="share of the board's bytes that the line spoils [%(default)s]")
    options = parser.parse_args()
    if not 0.0 <= options.bad_bytes <= 0.05:
        parser.error(f"--bad-bytes: found {options.bad_bytes}, allowed: 0 to 0.05")
    print("driving a board that is not there: a square of 1 m, then a circle while turning")
    with Master() as master:
        demo = Demo(master, options.bad_bytes)
        with demo.board:
            try:
                demo.drive()
            except AssertionError as error:
                print(f"the demo failed: {error}; the stack said:\n{demo.log.read_text()}", file=sys.stderr)
                return 1
            for what, value in demo.figures():
                print(f"  {what:<42} {value}")
        draw(demo, options.picture)
    print(f"picture: {options.picture}")
    good = all(found < allowed for found, allowed in zip(demo.error(), LARGEST_ERROR))
    if not good:
        print("the end pose is outside the bounds", file=sys.stderr)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
