"""A serial link under test, with all that it reports."""

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.serial_link import SerialLink
from robotont_driver.protocol.connection import Connection
from robotont_testing.robots import SHIPPED


class Ends:
    """The link to a port, within a `with` block; a plain board, whose packets may be checked."""

    def __init__(self, port, write_timeout=30.0, packets="plain"):
        self.packets = []
        self.changes = []
        self.failures = []
        self.connections = []
        self.expected = packets
        self.on_packet, self.on_change = self.packets.append, self.changes.append
        self.on_protocol, self.on_failure = lambda protocol: None, self.failures.append
        self.link = SerialLink(str(port), 115200, self, write_timeout, retry_period=0.05)

    def connect(self, usb_id, now):
        self.connections.append(Connection(read_wheels(SHIPPED), self.expected, usb_id=usb_id, now=now))
        return self.connections[-1]

    def __enter__(self):
        self.link.start()
        return self

    def __exit__(self, *_):
        self.link.close()
