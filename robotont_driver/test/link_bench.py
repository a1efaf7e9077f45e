"""A serial link under test, with all that it reports."""

import time

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.serial_link import SerialLink
from robotont_driver.protocol.checked import Checked
from robotont_testing.robots import SHIPPED

STOP = b"0:0:0;\n"


class Ends:
    """The link to a port, within a `with` block."""

    def __init__(self, port, write_timeout=30.0):
        self.reader = Checked(read_wheels(SHIPPED))
        self.packets = []
        self.changes = []
        self.failures = []
        self.link = SerialLink(str(port), 115200, self.received, self.changes.append, lambda: STOP,
                               self.failures.append, write_timeout, retry_period=0.05)

    def received(self, data):
        self.packets.extend(self.reader.feed(data, time.monotonic()))

    def __enter__(self):
        self.link.start()
        return self

    def __exit__(self, *_):
        self.link.close(STOP)
