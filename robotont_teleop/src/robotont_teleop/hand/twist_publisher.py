"""Twists on a topic of commands, and a zero at their end."""

import threading

from geometry_msgs.msg import Twist

from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher
from robotont_teleop.hand.speeds import STOP


class TwistPublisher(DroppingPublisher):
    """Of geometry_msgs/Twist."""

    def __init__(self, topic):
        super().__init__(topic, Twist)
        self._sending = threading.RLock()
        self._ended = False

    def send(self, twist):
        """Publish (v_x [m/s], v_y [m/s], omega [rad/s]); behind the call it is out, also where the process ends."""
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = twist
        with self._sending:
            if not self._ended:
                self.publish(message)

    def end(self):
        """A zero is the last that is sent."""
        with self._sending:
            self.send(STOP)
            self._ended = True
