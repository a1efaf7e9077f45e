"""What boards measure besides the wheels, and the lights of some, on the official driver's topics."""

import math
import time

import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import BatteryState, Range
from tf2_msgs.msg import TFMessage

from robotont_driver.protocol.protocol import Ranges

try:
    from robotont_msgs.msg import LedModulePixel, LedModuleSegment, PowerSupply
except ImportError:
    LedModulePixel = LedModuleSegment = PowerSupply = None  # only `range` and `battery`

FIELD_OF_VIEW = math.radians(25)
NEAREST, FARTHEST = 0.04, 4.0  # [m]
# Where the range sensors sit in base_link: distance from the centre [m], angle of the place and angle of the view
# [rad], both clockwise from forward.
SENSORS = (
    (0.163, 0.593, 0.52), (0.176, 1.047, 1.04), (0.163, 1.501, 1.57), (0.165, 2.094, 2.09), (0.161, 2.548, 2.63),
    (0.136, 3.142, 3.14), (0.162, 3.752, 3.66), (0.165, 4.206, 4.18), (0.163, 4.800, 4.71), (0.176, 5.253, 5.27),
    (0.163, 5.707, 5.76), (0.165, 0.0, 0.0),
)


class BoardTopics:
    """Publishes a board's readings; light(first, colours) is called to colour lights; battery: a `Battery`."""

    # all publishers are made at the start: to make one asks the master, which may hang

    def __init__(self, sensor_prefix, base_frame, battery, light):
        self._sensor_prefix, self._base_frame, self._battery = sensor_prefix, base_frame, battery
        self._ranges = rospy.Publisher("range", Range, queue_size=2 * len(SENSORS))
        self._battery_state = rospy.Publisher("battery", BatteryState, queue_size=1)
        self._places = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self._placed = False
        self._supply = PowerSupply and rospy.Publisher("power_supply", PowerSupply, queue_size=1)
        if LedModulePixel:
            rospy.Subscriber("led_pixel", LedModulePixel, lambda one: light(one.idx, [one.color]), queue_size=50)
            rospy.Subscriber("led_segment", LedModuleSegment, lambda some: light(some.idx_start, some.colors),
                             queue_size=50)

    def publish(self, readings):
        """Publish a list of `Ranges` and `Power`."""
        for reading in readings:
            (self._publish_ranges if isinstance(reading, Ranges) else self._publish_power)(reading)

    def _publish_ranges(self, ranges):
        if not self._placed:
            self._place_sensors(len(ranges.distances))
        message = Range(radiation_type=Range.INFRARED, field_of_view=FIELD_OF_VIEW,
                        min_range=NEAREST, max_range=FARTHEST)
        message.header.stamp = rospy.Time.now()
        for sensor, distance in enumerate(ranges.distances):
            message.header.frame_id = f"{self._sensor_prefix}{sensor}"
            message.range = distance
            self._ranges.publish(message)

    def _publish_power(self, power):
        self._battery.hear(power.voltage, power.current, time.monotonic())
        message = BatteryState(voltage=power.voltage, current=-power.current, charge=math.nan, capacity=math.nan,
                               design_capacity=math.nan, percentage=self._battery.charge, present=True)
        message.header.stamp = rospy.Time.now()
        self._battery_state.publish(message)
        if self._supply:
            self._supply.publish(PowerSupply(voltage=power.voltage, current=power.current))

    def _place_sensors(self, amount):
        """Publish where the sensors are, once."""
        self._placed = True
        transforms = []
        for sensor, (distance, place, view) in enumerate(SENSORS[:amount]):
            transform = TransformStamped(child_frame_id=f"{self._sensor_prefix}{sensor}")
            transform.header.frame_id, transform.header.stamp = self._base_frame, rospy.Time.now()
            transform.transform.translation.x = distance * math.cos(place)
            transform.transform.translation.y = -distance * math.sin(place)
            transform.transform.rotation.z = math.sin(-view / 2)
            transform.transform.rotation.w = math.cos(-view / 2)
            transforms.append(transform)
        self._places.publish(transforms)
