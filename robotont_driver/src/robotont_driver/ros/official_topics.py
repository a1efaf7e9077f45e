"""Topics `range` and `battery`: what boards measure besides the wheels."""

import contextlib
import math
import queue
import time

import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import BatteryState, Range
from tf2_msgs.msg import TFMessage

from robotont_driver.protocol.protocol import Ranges
from robotont_driver.ros.worker import Worker

FIELD_OF_VIEW = math.radians(25)
NEAREST, FARTHEST = 0.04, 4.0  # [m]
MOST_WAITING = 50  # readings
# Where the range sensors sit in base_link: distance from the centre [m], angle of the place and angle of the view
# [rad], both clockwise from forward.
SENSORS = (
    (0.163, 0.593, 0.52), (0.176, 1.047, 1.04), (0.163, 1.501, 1.57), (0.165, 2.094, 2.09), (0.161, 2.548, 2.63),
    (0.136, 3.142, 3.14), (0.162, 3.752, 3.66), (0.165, 4.206, 4.18), (0.163, 4.800, 4.71), (0.176, 5.253, 5.27),
    (0.163, 5.707, 5.76), (0.165, 0.0, 0.0),
)


class OfficialTopics:
    """Publishes a board's readings.

    battery: a `Battery`. It has a thread of its own: a publisher is made when its first reading comes, which asks the
    master, and a master that hangs must hold up nobody.
    """

    def __init__(self, sensor_prefix, base_frame, battery):
        self._battery = battery
        self._sensor_prefix = sensor_prefix
        self._base_frame = base_frame
        self._readings = queue.Queue(MOST_WAITING)
        self._publishers = {}  # by topic; made when the first reading comes
        Worker(self._publish)

    def publish(self, readings):
        """Publish a list of `Ranges` and `Power` soon; those that find no room are dropped."""
        for reading in readings:
            with contextlib.suppress(queue.Full):
                self._readings.put_nowait(reading)

    def _publish(self):
        with contextlib.suppress(queue.Empty):
            reading = self._readings.get(timeout=1.0)
            (self._publish_ranges if isinstance(reading, Ranges) else self._publish_power)(reading)
        return 0.0

    def _publish_ranges(self, ranges):
        if "range" not in self._publishers:
            self._place_sensors(len(ranges.distances))
        message = Range(radiation_type=Range.INFRARED, field_of_view=FIELD_OF_VIEW,
                        min_range=NEAREST, max_range=FARTHEST)
        message.header.stamp = rospy.Time.now()
        for sensor, distance in enumerate(ranges.distances):
            message.header.frame_id = f"{self._sensor_prefix}{sensor}"
            message.range = distance
            self._publisher("range", Range, queue_size=2 * len(SENSORS)).publish(message)

    def _publish_power(self, power):
        self._battery.hear(power.voltage, power.current, time.monotonic())
        message = BatteryState(voltage=power.voltage, current=-power.current, charge=math.nan, capacity=math.nan,
                               design_capacity=math.nan, percentage=self._battery.charge, present=True)
        message.header.stamp = rospy.Time.now()
        self._publisher("battery", BatteryState).publish(message)

    def _publisher(self, topic, message_type, queue_size=1):
        if topic not in self._publishers:
            self._publishers[topic] = rospy.Publisher(topic, message_type, queue_size=queue_size)
        return self._publishers[topic]

    def _place_sensors(self, amount):
        """Publish where the sensors are, once."""
        transforms = []
        for sensor, (distance, place, view) in enumerate(SENSORS[:amount]):
            transform = TransformStamped(child_frame_id=f"{self._sensor_prefix}{sensor}")
            transform.header.frame_id = self._base_frame
            transform.header.stamp = rospy.Time.now()
            transform.transform.translation.x = distance * math.cos(place)
            transform.transform.translation.y = -distance * math.sin(place)
            transform.transform.rotation.z = math.sin(-view / 2)
            transform.transform.rotation.w = math.cos(-view / 2)
            transforms.append(transform)
        self._tf_publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self._tf_publisher.publish(transforms)
