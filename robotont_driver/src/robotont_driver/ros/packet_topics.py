"""The topics `serial_write` and `serial_read`: between processes over ROS, within one by calls."""

import traceback

import rospy
from std_msgs.msg import String

from robotont_driver.protocol.plain import parse_packet
from robotont_driver.protocol.protocol import PacketError
from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher

BURST = 200  # copies that may wait for a slow listener; then the oldest are dropped


class PacketTopic:
    """A topic of packets between processes. `refused`: how many messages were none."""

    def __init__(self, name):
        self._name, self._message, self.refused = name, String(), 0

    def advertise(self):
        """A function that publishes a `Packet`; when it returns that is in the sockets of those who have room."""
        self._publisher = DroppingPublisher(self._name, String)
        return self._publish

    def _publish(self, packet):
        self._message.data = packet.told()
        self._publisher.publish(self._message)

    def subscribe(self, wheels, taken, queue_size=None):
        """From now on call taken(packet) for each `Packet` of `wheels` values; queue_size: None: all are kept."""
        def deliver(message):
            try:
                packet = parse_packet(message.data, wheels)
            except PacketError as error:
                self.refused += 1
                rospy.logwarn_throttle(10.0, f"{self._name} refused: {error}")
            else:
                taken(packet)
        rospy.Subscriber(self._name, String, deliver, queue_size=queue_size, tcp_nodelay=True)


class SharedPacketTopic:
    """A topic of packets within this process: who publishes calls the subscribers; other processes only get copies."""

    refused, _subscribers = 0, ()

    def __init__(self, name):
        self._name = name

    def advertise(self):
        """A function that hands a `Packet` to the subscribers, then to other processes, for whom nobody waits."""
        self._publisher = rospy.Publisher(self._name, String, queue_size=BURST)
        return self._publish

    def _publish(self, packet):
        for taken in self._subscribers:
            try:
                taken(packet)
            except Exception:  # a fault in one node must not end a thread of another, as over ROS
                rospy.logerr("%s: a subscriber failed:\n%s", self._name, traceback.format_exc())
        if self._publisher.get_num_connections():
            self._publisher.publish(packet.told())

    def subscribe(self, _wheels, taken, queue_size=None):
        """From now on call taken(packet) for each `Packet`."""
        self._subscribers = (*self._subscribers, taken)
