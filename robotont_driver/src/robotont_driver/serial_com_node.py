"""The ROS side of serial_com_node: serial_write to the port, the port to serial_read."""

import time

import rospy
from std_msgs.msg import String

from robotont_driver.echo import EchoWatch
from robotont_driver.motor import counts_in_reach
from robotont_driver.node import ERROR, OK, WARN, Health, ImmediatePublisher, Rate, run_node
from robotont_driver.parameters import Parameter
from robotont_driver.protocol import FeedbackReader, PacketError, add_checksum, format_packet, parse_packet
from robotont_driver.serial_link import SerialLink
from robotont_driver.timeouts import PUBLISH_RATE, WRITE_TIMEOUT, check_repetition

LARGEST_REACH = 0x7FFF  # [edges] what the 16 bits of a packet's totals can tell

PARAMETERS = (
    Parameter("port", "/dev/ttyACM0", "serial port of the board"),
    Parameter("baudrate", 115200, "speed of the line", "baud", minimum=1200, maximum=4000000,
              reason="no serial port is faster"),
    Parameter("packets", "auto", "packets on the line: plain (the thesis'), checked (with CRC), or auto: "
              "checked from the first valid checked packet on", choices=("auto", "plain", "checked")),
    Parameter("decimal_counts", False, "whether the board's plain packets may hold decimals; else such a packet is "
              "taken for an echo of a command"),
    Parameter("write_timeout", WRITE_TIMEOUT, "one stop packet after this long without a serial_write", "s",
              minimum=0.05, maximum=2.0, reason="for so long the robot drives on when driver_node dies"),
    Parameter("retry_period", 0.5, "pause between attempts to open the port", "s", minimum=0.05, maximum=60.0,
              reason="a board that is back should not wait longer"),
    Parameter("max_counts_per_period", 0, "what a motor can reach in one PID period, more is taken for an error on "
              "the line; 0 = from the wheel parameters, for a motor of 9375 rpm", "edges", minimum=0,
              maximum=LARGEST_REACH, reason="the totals in a packet have 16 bits"),
)


class SerialComNode:
    """Carries packets between the topics and the board, and says what the line did to them."""

    def __init__(self, wheels, parameters):
        self._wheels = wheels.amount
        self._stop = format_packet([0] * wheels.amount)
        self._reader = FeedbackReader(wheels.amount, reach(wheels, parameters), parameters["packets"],
                                      decimals=parameters["decimal_counts"])
        self._echo = EchoWatch()
        self._refused = 0         # messages on serial_write that are malformed
        self._restarts = 0        # of the board, that have been told
        self._trouble_before = 0  # errors up to the last report
        self._rate = Rate()
        self._publisher = ImmediatePublisher("serial_read", String)
        self._link = SerialLink(
            parameters["port"], parameters["baudrate"], self._on_bytes, self._on_change,
            stop_packet=lambda: self._encode(self._stop),
            write_timeout=parameters["write_timeout"], retry_period=parameters["retry_period"])
        rospy.on_shutdown(lambda: self._link.close(self._encode(self._stop)))
        rospy.Subscriber("serial_write", String, self._on_write, queue_size=1, tcp_nodelay=True)
        Health(parameters["port"], {"link": self._report})

    def _on_write(self, message):
        try:
            packet = parse_packet(message.data, self._wheels)
        except PacketError as error:
            self._refused += 1
            rospy.logwarn_throttle(1.0, "serial_write refused: %s", error)
            return
        line = self._encode(packet.text)
        self._echo.sent(line)
        self._link.send(line)

    def _encode(self, packet):
        return add_checksum(packet) if self._reader.checked else packet.encode("ascii")

    def _on_bytes(self, data):
        packets = self._reader.feed(data)
        if not self._reader.checked:  # no echo is a checked packet of counts
            self._echo.received(data)
            if self._echo.echoing:
                return
        for packet in packets:
            self._publisher.publish(packet.text)
        if self._reader.restarts > self._restarts:
            self._restarts = self._reader.restarts
            rospy.logwarn("the board has restarted; its encoder totals are taken afresh")

    def _on_change(self, trouble):
        if trouble:
            rospy.logwarn("%s", trouble)
        else:
            self._reader.connect()
            self._echo.connect()
            rospy.loginfo("port open")

    def _report(self):
        reader, link = self._reader, self._link
        read = reader.packets - reader.repaired
        rate = self._rate.look(read, time.monotonic())
        errors = sum(reader.dropped.values()) + self._refused
        new_errors, self._trouble_before = errors - self._trouble_before, errors
        values = {
            "packets": "checked" if reader.checked else "plain",
            "packets read per second": f"{rate:.1f}",
            "packets read": read,
            "packets published": reader.packets,
            "packets written": link.sent,
            "commands overtaken by newer ones": link.replaced,
            "commands while the port was closed": link.unsent,
            "commands refused": self._refused,
            "stops for lack of commands": link.timeouts,
            "lines dropped": sum(reader.dropped.values()),
            **{"lines dropped: " + kind: count for kind, count in sorted(reader.dropped.items())},
            "periods repaired": reader.repaired,
            "board restarts": reader.restarts,
            "reconnects": max(0, link.opened - 1),
            "board": reader.banner or "has not introduced itself",
        }
        if link.trouble:
            return ERROR, link.trouble, values
        if reader.fault:
            return ERROR, "the board reports: " + reader.fault, values
        if self._echo.echoing:
            return ERROR, ("the board sends back what it gets: it runs a REPL or another firmware (./robotont flash), "
                           "or the line is a loop; nothing is published on serial_read"), values
        if rate == 0.0:
            return WARN, "port open, but no packets: is the firmware running, at this baudrate?", values
        if new_errors:
            return WARN, f"{new_errors} lines dropped in the last second: check cable and baudrate", values
        return OK, f"{rate:.0f} packets/s", values


def reach(wheels, parameters):
    """[edges] that a motor can make in one PID period."""
    return parameters["max_counts_per_period"] or counts_in_reach(wheels)


def check(wheels, parameters, other):
    """What does not fit together, or to driver_node, in words."""
    faults = check_repetition(other("driver_node/publish_rate", PUBLISH_RATE), parameters["write_timeout"])
    edges = reach(wheels, parameters)
    if edges > LARGEST_REACH:
        faults.append(f"encoderEdgesPerMotorRevolution and pidControlFrequency: found {edges} edges in one PID period, "
                      f"allowed: up to {LARGEST_REACH}, or a ~max_counts_per_period")
    return faults


def main():
    """Run serial_com_node."""
    run_node("serial_com_node", SerialComNode, PARAMETERS, check)
