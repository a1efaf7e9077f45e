"""The ROS side of mock_serial_node: a board whose motors follow at once, without a serial port."""

import rospy
from std_msgs.msg import String

from robotont_driver.protocol.packet import Packet, PacketError, parse_packet
from robotont_driver.ros.lifecycle import run_node

PARAMETERS = ()


class MockSerialNode:
    """Answers each packet on serial_write with one on serial_read, as if one PID period had passed."""

    def __init__(self, _name, wheels, _parameters):
        self._wheels = wheels.amount
        self._turned = [0.0] * wheels.amount  # [edges] since the start
        self._publisher = rospy.Publisher("serial_read", String, queue_size=100)
        rospy.Subscriber("serial_write", String, self._on_write, tcp_nodelay=True)

    def _on_write(self, message):
        try:
            units = parse_packet(message.data, self._wheels)
        except PacketError as error:
            rospy.logwarn_throttle(10.0, "serial_write refused: %s", error)
            return
        before, self._turned = self._turned, [edges + unit for edges, unit in zip(self._turned, units)]
        self._publisher.publish(Packet(round(now) - round(then) for now, then in zip(self._turned, before)).text)


def main():
    """Run mock_serial_node."""
    run_node(MockSerialNode)
