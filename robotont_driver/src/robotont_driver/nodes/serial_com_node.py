"""The ROS side of serial_com_node: serial_write to the port, the port to serial_read."""

import functools

import rospy
from std_msgs.msg import Float64

from robotont_driver.kinematics.wheel_params import counts_in_reach
from robotont_driver.link.serial_link import SerialLink
from robotont_driver.parameters.parameters import Parameter, ParameterError
from robotont_driver.protocol.connection import AUTO, NAMES, Connection, explained
from robotont_driver.protocol.protocol import ProtocolError
from robotont_driver.robots.battery import Battery, read_pack
from robotont_driver.ros.board_topics import BoardTopics
from robotont_driver.ros.diagnostics import Health
from robotont_driver.ros.link_report import LinkReport
from robotont_driver.ros.repeating_thread import log_fault

LARGEST_REACH = 0x7FFF  # [edges] what the 16 bits of a packet's totals can represent

PARAMETERS = (
    Parameter("port", "/dev/ttyACM0", "serial port of the board", official="serial/port"),
    Parameter("baudrate", 115200, "speed of the line", "baud", minimum=1200, maximum=4000000,
              reason="no serial port is faster", official="serial/baudrate"),
    Parameter("packets", AUTO, "protocol of the board: plain (the thesis'), checked (with CRC), robotont2 or robotont3 "
              "(official firmware, another board is refused), or auto: recognised from its output",
              choices=NAMES),
    Parameter("write_timeout", 0.5, "a stop, where it may still drive, after each such time without a "
              "serial_write", "s", minimum=0.2,
              maximum=2.0, reason="for so long the robot drives on when driver_node dies; two packets come in 0.2 s"),
    Parameter("range_frame_prefix", "range_sensor_", "frames of the range sensors, before their number",
              official="range/sensor_frame_prefix"),
    Parameter("base_frame", "base_link", "frame in which the range sensors stand"),
)


def check_protocol(wheels, packets):
    """Raise ParameterError where no board of a protocol can have these wheels."""
    edges = counts_in_reach(wheels)
    if edges > LARGEST_REACH:
        raise ParameterError(["encoderEdgesPerMotorRevolution and pidControlFrequency: found "
                              f"{edges} edges in one PID period, allowed: up to {LARGEST_REACH}"])
    try:
        Connection(wheels, packets)
    except ProtocolError as error:
        raise ParameterError([f"~packets is {packets}, but its board cannot have these wheels: {error}"]) from None


class SerialComNode:
    """Carries packets between the topics and the board, in the board's protocol, and reports errors on the line."""

    def __init__(self, name, wheels, parameters, topic):
        self._port = parameters["port"]
        self.connect = functools.partial(Connection, wheels, parameters["packets"])
        check_protocol(wheels, parameters["packets"])
        battery = Battery(read_pack(rospy.get_param("battery", None)))
        self._publish = topic("serial_read").advertise()
        self._limit = rospy.Publisher("board_wheel_limit", Float64, queue_size=1, latch=True)
        self._link = SerialLink(self._port, parameters["baudrate"], self, parameters["write_timeout"])
        self._topics = BoardTopics(parameters["range_frame_prefix"], parameters["base_frame"], battery, self._on_light)
        self._link.start()
        rospy.on_shutdown(self._link.close)
        written = topic("serial_write")
        written.subscribe(wheels.amount, self._on_write, queue_size=1)
        report = LinkReport(self._link, written, battery)
        Health(self._port, {"link": report.report_link, "board": report.report_board}, name)

    def _on_write(self, command):
        self._link.send(command)
        connection = self._link.connection
        if connection and connection.obstacle:
            rospy.logerr_throttle(10.0, "does not drive: %s (docs/robots.md)", connection.obstacle)

    def on_packet(self, packet):
        """A `Packet` of the board."""
        packet.commanded = self._link.commanded
        self._publish(packet)
        protocol = self._link.connection.protocol
        if protocol.readings:
            readings, protocol.readings = protocol.readings, []
            self._topics.publish(readings)

    def _on_light(self, first, colours):
        protocol = self._link.connection and self._link.connection.protocol
        for line in protocol.encode_lights(first, [(one.r, one.g, one.b) for one in colours]) if protocol else ():
            self._link.add(line)

    on_failure = staticmethod(log_fault)

    def on_protocol(self, protocol):
        """The board's protocol is known."""
        rospy.loginfo("%s: the board speaks %s", self._port, explained(protocol.name))
        self._limit.publish(protocol.fastest)
        if protocol.complaint:
            rospy.logwarn("%s", protocol.complaint)

    def on_change(self, trouble):
        """The port was opened, or lost with a message."""
        before = self._link.opened - (not trouble)  # the simulator's port comes a moment later
        again = "open again; what wheels have turned meanwhile is missing in the odometry" if before else "open"
        words = f"{'' if before else 'waiting: '}{trouble}" if trouble else f"{self._port}: {again}"
        (rospy.logwarn if before else rospy.loginfo)("%s", words)
