"""The ROS side of serial_com_node: serial_write to the port, the port to serial_read."""

import time

import rospy
from std_msgs.msg import String

from robotont_driver.node import ERROR, OK, WARN, Health, ImmediatePublisher, Rate, run_node
from robotont_driver.parameters import Parameter
from robotont_driver.protocol import FeedbackReader, PacketError, format_packet, parse_packet
from robotont_driver.serial_link import SerialLink

PARAMETERS = (
    Parameter("port", "/dev/ttyACM0", "serial port of the board"),
    Parameter("baudrate", 115200, "speed of the line", "baud", minimum=1),
    Parameter("packets", "auto", "packets on the line: plain (the thesis'), checked (with CRC), or auto: "
              "checked from the first valid checked packet on", choices=("auto", "plain", "checked")),
    Parameter("write_timeout", 0.5, "one stop packet after this long without a serial_write", "s",
              minimum=0.05),
    Parameter("retry_period", 0.5, "pause between attempts to open the port", "s", minimum=0.05),
    Parameter("max_counts_per_period", 300, "what a motor can reach in one PID period; more is taken for "
              "an error on the line", "edges", minimum=1),
)


class SerialComNode:
    """Carries packets between the topics and the board, and says what the line did to them."""

    def __init__(self, wheels, parameters):
        self._wheels = wheels.amount
        self._stop = format_packet([0] * wheels.amount)
        self._reader = FeedbackReader(
            wheels.amount, parameters["max_counts_per_period"], parameters["packets"], wheels.pid_frequency)
        self._refused = 0         # messages on serial_write that are no packets
        self._restarts = 0        # of the board, that have been told
        self._trouble_before = 0  # errors up to the last report
        self._rate = Rate()
        self._publisher = ImmediatePublisher("serial_read", String)
        self._link = SerialLink(
            parameters["port"], parameters["baudrate"], self._on_bytes, self._on_change,
            stop_packet=lambda: self._reader.encode(self._stop),
            write_timeout=parameters["write_timeout"], retry_period=parameters["retry_period"])
        rospy.on_shutdown(lambda: self._link.close(self._reader.encode(self._stop)))
        rospy.Subscriber("serial_write", String, self._on_write, queue_size=1, tcp_nodelay=True)
        Health(parameters["port"], {"link": self._report, "board": self._report_board})

    def _on_write(self, message):
        try:
            parse_packet(message.data, self._wheels)
        except PacketError as error:
            self._refused += 1
            rospy.logwarn_throttle(1.0, "serial_write refused: %s", error)
            return
        if self._reader.obstacle:
            rospy.logerr_throttle(10.0, "does not drive: %s", self._reader.obstacle)
        self._link.send(self._reader.encode(message.data.partition(";")[0] + ";\n"))

    def _on_bytes(self, data):
        for counts in self._reader.feed(data):
            self._publisher.publish(format_packet(counts, 0 if isinstance(counts[0], int) else 2))
        if self._reader.restarts > self._restarts:
            self._restarts = self._reader.restarts
            rospy.logwarn("the board has restarted; its encoder totals are taken afresh")

    def _on_change(self, trouble):
        if trouble:
            rospy.logwarn("%s", trouble)
        else:
            self._reader.connect()
            rospy.loginfo("port open")

    def _report(self):
        reader, link = self._reader, self._link
        rate = self._rate.look(reader.packets, time.monotonic())
        errors = sum(reader.dropped.values()) + self._refused
        new_errors, self._trouble_before = errors - self._trouble_before, errors
        values = {
            "packets": "checked" if reader.checked else "plain",
            "packets read per second": f"{rate:.1f}",
            "packets read": reader.packets,
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
        }
        if link.trouble:
            return ERROR, link.trouble, values
        if rate == 0.0:
            return WARN, "port open, but no packets: is the firmware running, at this baudrate?", values
        if new_errors:
            return WARN, f"{new_errors} lines dropped in the last second: check cable and baudrate", values
        return OK, f"{rate:.0f} packets/s", values

    def _report_board(self):
        errors, warnings, values = self._reader.health.report()
        if self._link.trouble:
            return WARN, "the port is closed", values
        level = ERROR if errors else WARN if warnings else OK
        return level, " / ".join(errors + warnings) or "reports no fault", values


def main():
    """Run serial_com_node."""
    run_node("serial_com_node", SerialComNode, PARAMETERS)
