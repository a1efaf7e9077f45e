"""The robots that the demo drives. Each starts the stack behind a line that spoils bytes, and records its truth.

`name` for display; `LARGEST_ERROR` ([m], [rad]) that the odometry may have at the end;
`truth` a Track; `log` the file with the stack's output; `figures(commands)` rows for the closing table that only this
robot can give.
"""

import math
import time

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32

from robotont_demo.recording import Track
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Board


class Simulated:
    """The simulator. Truth: where its robot stands; wheels slip a little, which no odometry can see."""

    def __init__(self, master, bad_bytes, robot):
        # the official firmware allows a wheel 0.3 m/s; generation 2 sums every second encoder window only
        official = robot.packets != "auto"
        self.name = f"the simulator, robot {robot.folder.name}"
        self.LARGEST_ERROR = (0.06, math.radians(5.0)) if official else (0.03, math.radians(2.0))
        self.truth = Track()
        self.log = master.folder / "log"
        self._bad_bytes = bad_bytes
        self._stands = False
        master.launch("simulation.launch", f"port:={master.folder / 'board'}", f"robot:={robot.folder}/",
                      log=self.log)

    def connect(self):
        """Listen to the ground truth, spoil the line."""
        self._subscriber = rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, tcp_nodelay=True)
        self._errors = rospy.Publisher("simulator_node/byte_errors", Float32, queue_size=1, latch=True)
        self._errors.publish(self._bad_bytes)

    def _on_truth(self, message):
        self.truth.add_odometry(message)
        twist = message.twist.twist
        self._stands = max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z)) < 2e-3

    def stands(self):
        """Whether the robot stands."""
        return self._stands

    def figures(self, _commands):
        """None."""
        return []

    def close(self):
        """Listen no longer."""
        self._subscriber.unregister()


class IdealMotors:
    """A board with ideal motors. Truth: the path that the wheels really make, fractions of edges included."""

    name = "a board with ideal motors"
    LARGEST_ERROR = (1e-3, math.radians(0.1))

    def __init__(self, master, bad_bytes, _robot):
        self.truth = Track()
        self.log = master.folder / "log"
        kinematics = Kinematics(read_wheels(SHIPPED))
        self._to_motion = kinematics.inverse * np.array(kinematics.wheels.metres_per_edge)
        self._turned = np.zeros(kinematics.wheels.amount)
        self._pose = 0.0, 0.0, 0.0
        self._arrivals = []  # [s] monotonic, of the PC's writes
        self._board = Board(str(master.folder / "board"))
        self._board.line.corrupt = bad_bytes
        self._board.on_period = self._on_period
        self._board.on_bytes = lambda now, _: self._arrivals.append(now)
        self._board.plug()
        master.launch("robot.launch", f"port:={self._board.link}", log=self.log)

    def connect(self):
        """Nothing to connect: the board lives in this process."""

    def _on_period(self, turned):
        turned = np.array(turned)
        self._pose = se2.compose(self._pose, se2.arc((self._to_motion @ (turned - self._turned)).tolist()))
        self._turned = turned
        self.truth.add(time.time(), self._pose)  # the clock of the messages' stamps

    def stands(self):
        """Whether the wheels stand."""
        return not any(self._board.speeds)

    def figures(self, commands):
        """Packets, and the time from a command to its bytes at the board. commands: [s] monotonic, of publishing."""
        arrivals = np.array(self._arrivals)
        first = np.searchsorted(arrivals, commands)
        first, sent = first[first < len(arrivals)], np.array(commands)[first < len(arrivals)]
        median, late = np.percentile(1000 * (arrivals[first] - sent), (50, 99))
        return [
            ("packets to the board", len(self._board.heard)),
            ("packets from the board", len(self._board.reported)),
            ("command to board, median", f"{median:.2f} ms"),
            ("command to board, 99 %", f"{late:.2f} ms"),
        ]

    def close(self):
        """Unplug."""
        self._board.unplug()
