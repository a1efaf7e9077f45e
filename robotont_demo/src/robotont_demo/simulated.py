"""The simulated robot that the demo drives: starts the stack behind a line that spoils bytes, and records the truth."""

import math

import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Float32

from robotont_demo.recording import Track


class Simulated:
    """The simulator. `truth`: where its robot stands; wheels slip a little, which no odometry can see.

    `name` for display; `LARGEST_ERROR` ([m], [rad]) that the odometry may have at the end; `log`: the stack's output.
    """

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

    def close(self):
        """Listen no longer."""
        self._subscriber.unregister()
