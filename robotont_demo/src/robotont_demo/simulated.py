"""The simulated robot that the demo drives: starts the stack behind a line that spoils bytes, and records the truth."""

import math
import os
import signal
import socket
import subprocess
import tempfile
from pathlib import Path

import rosgraph
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32

from robotont_demo.recording import Track
from robotont_demo.waiting import wait_for

LONGEST_END = 20.0  # [s] that the stack may take to end


class Simulated:
    """The simulator, under a ROS master of its own; it ends with the `with` block.

    `truth`: where its robot stands; wheels slip a little, which no odometry can see. `name` for display;
    `LARGEST_ERROR` ([m], [rad]) that the odometry may have at the end; `log`: the stack's output.
    """

    def __init__(self, bad_bytes, robot):
        # the official firmware allows a wheel 0.3 m/s; generation 2 sums every second encoder window only
        official = robot.packets != "auto"
        self.name = f"the simulator, robot {robot.folder.name}"
        self.LARGEST_ERROR = (0.06, math.radians(5.0)) if official else (0.03, math.radians(2.0))
        self.truth = Track()
        # ./robotont removes its folder whatever ends the demo
        lifeline = os.environ.get("ROBOTONT_LIFELINE", "").rpartition(":")[2]
        self._folder = tempfile.TemporaryDirectory(dir=lifeline or None)
        self.log = Path(self._folder.name) / "log"
        self._bad_bytes = bad_bytes
        self._stands = False
        self._start(f"port:={self.log.with_name('board')}", f"robot:={robot.folder}/")

    def _start(self, *arguments):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=self._folder.name)
        with open(str(self.log), "wb") as output:
            self._stack = subprocess.Popen(
                ["roslaunch", "-p", str(port), "robotont_bringup", "simulation.launch", *arguments],
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, start_new_session=True)

    def wait_for_master(self):
        """Until the ROS master answers; AssertionError where it does not."""
        wait_for(rosgraph.is_master_online, "the ROS master")

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

    def close(self):
        """Listen no longer."""
        self._subscriber.unregister()

    def __enter__(self):
        """It has been started."""
        return self

    def __exit__(self, *_):
        """End it as Ctrl-C does."""
        os.killpg(self._stack.pid, signal.SIGINT)
        try:
            self._stack.wait(LONGEST_END)
        except subprocess.TimeoutExpired:
            os.killpg(self._stack.pid, signal.SIGKILL)
            self._stack.wait()
        self._folder.cleanup()
