"""What the stack publishes: odometry and truth, whether it takes commands, and since when the robot stands."""

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry

from robotont_calibration.recordings import Recording


class Recorder(Recording):
    """Listens to the stack until `end`; what `Recording` has of it is `odometry` and `truth`."""

    def __init__(self):
        super().__init__()
        self.stands_since = None  # [s] stamp of the first true pose of a robot that stands; None while it moves
        self.link = None          # values of the link's newest diagnostics, by key
        self.drives = False       # whether commands reach the board, and it obeys them
        self._subscribers = [
            rospy.Subscriber("odom", Odometry, lambda message: self.take("odometry", 0.0, message), tcp_nodelay=True),
            rospy.Subscriber("ground_truth/odom", Odometry, self._on_truth, tcp_nodelay=True),
            rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
        ]

    def _on_truth(self, message):
        self.take("truth", 0.0, message)
        twist = message.twist.twist
        if max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z)) >= 2e-3:  # wheels slip a little
            self.stands_since = None
        elif self.stands_since is None:
            self.stands_since = self.truth[-1][0]

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}
            if status.name.endswith(": board"):
                self.drives = obeys(status, self.link)

    def end(self):
        """Listen no longer."""
        for subscriber in self._subscribers:
            subscriber.unregister()


def obeys(board, link):
    """Whether a board follows commands, by its DiagnosticStatus and the link's values (None: not known yet).

    At the start the board is asked who it is, and driver_node connects to the link: a command before that comes late.
    """
    return board.level == board.OK and link is not None and int(link["packets written"]) > 0
