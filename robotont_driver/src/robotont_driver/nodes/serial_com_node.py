"""The ROS side of serial_com_node: serial_write to the port, the port to serial_read."""

import functools
import threading
import traceback

import rospy
from std_msgs.msg import Float64

from robotont_driver.kinematics.wheel_params import counts_in_reach
from robotont_driver.link.serial_link import SerialLink
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.protocol.connection import AUTO, NAMES, Connection, explained
from robotont_driver.protocol.protocol import ProtocolError
from robotont_driver.robots.battery import Battery, read_pack
from robotont_driver.ros.diagnostics import Health
from robotont_driver.ros.lifecycle import refuse, run_node
from robotont_driver.ros.link_report import LinkReport
from robotont_driver.ros.official_topics import OfficialTopics
from robotont_driver.ros.packet_topics import PacketTopic

DOUBT = "lines of the board were lost, or it has restarted: the odometry may be wrong by the counts between"
START_PATIENCE = 6.0  # [s] for which a board may be missing at the start before the log says so; diagnostics do at once
LARGEST_REACH = 0x7FFF  # [edges] what the 16 bits of a packet's totals can represent

PARAMETERS = (
    Parameter("port", "/dev/ttyACM0", "serial port of the board", official="serial/port"),
    Parameter("baudrate", 115200, "speed of the line", "baud", minimum=1200, maximum=4000000,
              reason="no serial port is faster", official="serial/baudrate"),
    Parameter("packets", AUTO, "protocol of the board: plain (the thesis'), checked (with CRC), robotont2 or robotont3 "
              "(official firmware, another board is refused), or auto: recognised from its output",
              choices=NAMES),
    Parameter("write_timeout", 0.5, "one stop packet after this long without a serial_write", "s", minimum=0.2,
              maximum=2.0, reason="for so long the robot drives on when driver_node dies; two packets come in 0.2 s"),
    Parameter("range_frame_prefix", "range_sensor_", "frames of the range sensors, before their number",
              official="range/sensor_frame_prefix"),
    Parameter("base_frame", "base_link", "frame in which the range sensors stand"),
)


class SerialComNode:
    """Carries packets between the topics and the board, in the board's protocol, and reports errors on the line.

    name: full name of the node. topic(name): a topic of packets, as `PacketTopic`.
    """

    def __init__(self, name, wheels, parameters, topic):
        self._port = parameters["port"]
        connect = functools.partial(Connection, wheels, parameters["packets"])
        try:
            connect()
            battery = Battery(read_pack(rospy.get_param("battery", None)))
        except ProtocolError as error:
            refuse([f"~packets is {parameters['packets']}, but its board cannot have these wheels: {error}"])
        except ValueError as error:
            refuse([str(error)])
        self._refused = 0  # malformed messages on serial_write
        self._told = (0, 0)  # restarts and doubts of the connection, already reported
        self._read = topic("serial_read")
        self._read.advertise()
        self._limit = rospy.Publisher("board_wheel_limit", Float64, queue_size=1, latch=True)
        self._link = SerialLink(self._port, parameters["baudrate"], connect, self._on_packet, self._on_change,
                                self._on_protocol, self._on_failure, write_timeout=parameters["write_timeout"])
        self._topics = OfficialTopics(parameters["range_frame_prefix"], parameters["base_frame"], battery,
                                      self._on_light)
        self._link.start()
        rospy.on_shutdown(self._link.close)
        topic("serial_write").subscribe(wheels.amount, self._on_write, self._on_refused, queue_size=1)
        report = LinkReport(self._link, lambda: self._refused, battery)
        Health(self._port, {"link": report.report_link, "board": report.report_board}, name)

    def _on_refused(self, error):
        self._refused += 1
        rospy.logwarn_throttle(10.0, f"serial_write refused: {error}")

    def _on_write(self, command):
        self._link.send(command)
        connection = self._link.connection
        if connection and connection.obstacle:
            rospy.logerr_throttle(10.0, "does not drive: %s (docs/robots.md)", connection.obstacle)

    def _on_packet(self, packet):
        self._read.publish(packet)
        protocol = self._link.connection.protocol
        if protocol.readings:
            readings, protocol.readings = protocol.readings, []
            self._topics.publish(readings)
        restarts, doubts = protocol.restarts, protocol.doubts
        if (restarts, doubts) != self._told:
            if restarts > self._told[0]:
                rospy.logwarn("the board has restarted; counts that it has not sent before are missing in the odometry")
            if doubts > self._told[1]:
                rospy.logwarn_throttle(10.0, DOUBT)
            self._told = restarts, doubts

    def _on_light(self, first, colours):
        protocol = self._link.connection and self._link.connection.protocol
        for line in protocol.encode_lights(first, colours) if protocol else ():
            self._link.add(line)

    def _on_failure(self, error):
        """An exception in the link's thread: a fault of this program."""
        if not rospy.is_shutdown():
            lines = "".join(traceback.format_exception(type(error), error, error.__traceback__))
            rospy.logerr_throttle(10.0, "a fault of serial_com_node itself; please report it: %s", lines)

    def _on_protocol(self, protocol):
        rospy.loginfo("%s: the board speaks %s", self._port, explained(protocol.name))
        self._limit.publish(protocol.fastest)
        if protocol.complaint:
            rospy.logwarn("%s", protocol.complaint)

    def _on_change(self, trouble):
        if trouble and self._link.opened:
            rospy.logwarn("%s", trouble)
        elif trouble:  # the simulator's board comes a moment later
            timer = threading.Timer(START_PATIENCE, self._complain)
            timer.daemon = True
            timer.start()
        elif self._link.opened > 1:
            self._told = (0, 0)
            rospy.logwarn("%s: open again; what wheels have turned meanwhile is missing in the odometry", self._port)
        else:
            rospy.loginfo("%s: open", self._port)

    def _complain(self):
        trouble = self._link.trouble
        if trouble and not self._link.opened:  # otherwise it was reported when it came
            rospy.logwarn("%s", trouble)


def conflicts(wheels, _parameters):
    """List of conflicts between parameters."""
    edges = counts_in_reach(wheels)
    return [] if edges <= LARGEST_REACH else [
        f"encoderEdgesPerMotorRevolution and pidControlFrequency: found {edges} edges in one PID period, allowed: up "
        f"to {LARGEST_REACH}"]


def main():
    """Run serial_com_node."""
    run_node(SerialComNode, PacketTopic)
