"""What the stack publishes: odometry and truth, and whether it takes commands."""

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry

from robotont_calibration.recordings import Recording


class Recorder(Recording):
    """Listens to the stack; what `Recording` has of it is `odometry` and `truth`."""

    def __init__(self):
        super().__init__()
        self.link = None          # values of the link's newest diagnostics, by key
        self.drives = False       # whether commands reach the board, and it obeys them
        for topic, kind in (("odom", "odometry"), ("ground_truth/odom", "truth")):
            rospy.Subscriber(topic, Odometry, lambda message, kind=kind: self.take(kind, 0.0, message))
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics)

    def _on_diagnostics(self, message):
        for status in message.status:
            if status.name.endswith(": link"):
                self.link = {value.key: value.value for value in status.values}
            if status.name.endswith(": board"):
                self.drives = obeys(status, self.link)


def obeys(board, link):
    """Whether a board follows commands, by its DiagnosticStatus and the link's values (None: not known yet).

    At the start the board is asked who it is, and driver_node connects to the link: a command before that comes late.
    """
    return board.level == board.OK and link is not None and int(link["packets written"]) > 0
