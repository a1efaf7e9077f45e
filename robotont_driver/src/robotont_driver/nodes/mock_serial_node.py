"""The ROS side of mock_serial_node: a board whose motors follow at once, without a serial port."""

import rospy
from std_msgs.msg import String

from robotont_driver.protocol.packet import PacketError, WholeCounts, parse_packet
from robotont_driver.ros.lifecycle import run_node

PARAMETERS = ()


class MockSerialNode:
    """Answers each packet on serial_write with one on serial_read, as if one PID period had passed."""

    def __init__(self, _name, wheels, _parameters):
        self._wheels = wheels.amount
        self._motors = WholeCounts(wheels.amount)
        self._publisher = rospy.Publisher("serial_read", String, queue_size=100)
        rospy.Subscriber("serial_write", String, self._on_write, tcp_nodelay=True)

    def _on_write(self, message):
        try:
            units = parse_packet(message.data, self._wheels)
        except PacketError as error:
            rospy.logwarn_throttle(10.0, "serial_write refused: %s", error)
            return
        self._publisher.publish(self._motors.share(units)[0].text)


def main():
    """Run mock_serial_node."""
    run_node(MockSerialNode)
