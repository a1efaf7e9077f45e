"""What a robot tells of itself, for the web pages: the newest of its topics and transforms."""

import math
import threading
import time

import numpy as np
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import BatteryState, LaserScan, Range
from std_msgs.msg import String

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import compose, pose_of, yaw_of
from robotont_driver.protocol.packet import PacketError, parse_packet
from robotont_driver.ros.worker import Worker
from robotont_teleop.hand.robot_reports import SILENT, NewestDiagnostics
from robotont_teleop.web.page_pictures import finite, map_picture, rounded, thinned_scan

MAP_FRAME = "map"
STALE = 1.0             # [s] a value that has not come for so long is not shown
SLOW_PERIOD = 0.2       # [s] between two looks at transforms
MEASURED_PACKETS = 5    # over which the measured wheel speeds are averaged
SCAN_PERIOD = 0.2       # [s] between two scans for the pages
LONGEST_WAY = 0.5       # [m] between two poses; beyond, the odometry was reset
LIGHTS, RANGES = 24, 16
NEVER = -math.inf


class RobotTopics:
    """The newest of everything that a robot publishes; calls never wait."""

    def __init__(self, wheels):
        self.transforms = tf2_ros.Buffer()
        self.map_picture = None  # PNG
        self._kinematics = Kinematics(wheels)
        self._lock = threading.Lock()
        self._newest = {}      # name: (time [s], value) of values that become stale
        self._diagnostics = NewestDiagnostics()
        self._driven = 0.0     # [m]
        self._ranges = {}      # frame: (time [s], distance [m] or None)
        self._counts = []      # of the newest packets
        self._scan, self._scan_at = None, NEVER
        self._map = None
        self._map_to_odom, self._laser = None, {}
        self._frames = None    # (odom frame, base frame)
        self._driven_by = ""
        self._listener = tf2_ros.TransformListener(self.transforms)
        for topic, kind, callback in (
                ("odom", Odometry, self._on_odometry), ("serial_write", String, self._on_commanded),
                ("serial_read", String, self._on_counts), ("/diagnostics", DiagnosticArray, self._on_diagnostics),
                ("cmd_vel/driven_by", String, self._on_driven_by), ("battery", BatteryState, self._on_battery),
                ("range", Range, self._on_range), ("scan", LaserScan, self._on_scan),
                ("map", OccupancyGrid, self._on_map)):
            rospy.Subscriber(topic, kind, callback, queue_size=1 if topic != "/diagnostics" else 50)
        Worker(self._look_at_transforms)

    def fast(self):
        """What changes fast, for JSON."""
        with self._lock:
            return {
                "pose": rounded(self._pose(), 4), "velocity": rounded(self._fresh("velocity"), 3),
                "commanded": rounded(self._fresh("commanded"), 3), "measured": rounded(self._measured(), 3),
                "driven_by": self._driven_by,
            }

    def slow(self):
        """What changes slowly, for JSON."""
        now = time.monotonic()
        lights = self._diagnostics.lights(now)
        with self._lock:
            return {
                "frame": MAP_FRAME if self._map_to_odom else (self._frames or ("",))[0],
                "lights": lights[:LIGHTS], "board": self._diagnostics.board,
                "battery": self._fresh("battery", SILENT),
                "ranges": [value for _, (at, value) in sorted(self._ranges.items()) if now - at < STALE][:RANGES],
                "map": self._map,
            }

    def numbers(self):
        """What `metrics` wants of this robot."""
        velocity = self._fresh("velocity")
        return {"driven": self._driven, "battery": self._fresh("battery", SILENT),
                "speed": [math.hypot(*velocity[:2])] if velocity else None,
                "worst": self._diagnostics.worst(time.monotonic())}

    def diagnostic_values(self):
        """{task: {"level", key: number}}."""
        return self._diagnostics.values(time.monotonic())

    def scan(self):
        """The newest scan for JSON, or None."""
        return self._scan if time.monotonic() - self._scan_at < STALE else None

    def yaw_on_map(self):
        """[rad], 0 where it is unknown."""
        pose = self._pose()
        return pose[2] if pose and self._map_to_odom else 0.0

    def _pose(self):
        """(x, y, yaw) on the map where there is one, else of the odometry; None when it is unknown."""
        pose = self._fresh("pose")
        return compose(self._map_to_odom, pose) if pose and self._map_to_odom else pose

    def _measured(self):
        if self._fresh("counts") is None:
            return None
        return self._kinematics.speeds_of_units(np.mean(self._counts, axis=0).tolist())

    def _fresh(self, name, within=STALE):
        at, value = self._newest.get(name, (NEVER, None))
        return value if time.monotonic() - at < within else None

    def _keep(self, **values):
        now = time.monotonic()
        with self._lock:
            for name, value in values.items():
                self._newest[name] = (now, value)

    def _on_odometry(self, message):
        self._frames = (message.header.frame_id, message.child_frame_id)
        twist = message.twist.twist
        pose, before = pose_of(message.pose.pose), self._newest.get("pose")
        way = math.dist(pose[:2], before[1][:2]) if before else 0.0
        self._driven += way if way < LONGEST_WAY else 0.0
        self._keep(pose=pose, velocity=(twist.linear.x, twist.linear.y, twist.angular.z))

    def _on_commanded(self, message):
        units = self._units(message.data)
        if units is not None:
            self._keep(commanded=self._kinematics.speeds_of_units(units))

    def _on_counts(self, message):
        counts = self._units(message.data)
        if counts is not None:
            self._keep(counts=True)
            with self._lock:
                self._counts = [*self._counts[1 - MEASURED_PACKETS:], counts]

    def _units(self, packet):
        try:
            return parse_packet(packet, self._kinematics.wheels.amount)
        except PacketError:
            return None

    def _on_diagnostics(self, message):
        self._diagnostics.hear(message, time.monotonic())

    def _on_driven_by(self, message):
        self._driven_by = message.data

    def _on_battery(self, message):
        charge = message.percentage
        self._keep(battery={"voltage": finite(message.voltage, 1), "charge": finite(charge, 2)})

    def _on_range(self, message):
        distance = message.range if message.min_range <= message.range <= message.max_range else None
        with self._lock:
            if message.header.frame_id in self._ranges or len(self._ranges) < RANGES:
                self._ranges[message.header.frame_id] = (time.monotonic(), finite(distance, 2))

    def _on_scan(self, message):
        now = time.monotonic()
        laser = self._laser.get(message.header.frame_id)
        if laser is None:
            self._laser.setdefault(message.header.frame_id, None)
            return
        if now - self._scan_at < SCAN_PERIOD:
            return
        scan = thinned_scan(message, laser, self._scan["number"] + 1 if self._scan else 1)
        if scan is None:
            return
        self._scan = scan
        self._scan_at = now

    def _on_map(self, message):
        try:
            picture, described = map_picture(message)
        except ValueError as error:
            rospy.logwarn("a map is not shown: %s", error)
            return
        with self._lock:
            self.map_picture, self._map = picture, described

    def _look_at_transforms(self):
        if self._frames:
            odom, base = self._frames
            self._map_to_odom = self._transform(MAP_FRAME, odom)
            for frame in tuple(self._laser):
                self._laser[frame] = self._transform(base, frame)
        return SLOW_PERIOD

    def _transform(self, target, source):
        """(x, y, yaw) of frame `source` in frame `target`, or None."""
        try:
            transform = self.transforms.lookup_transform(target, source, rospy.Time(0)).transform
        except (tf2_ros.TransformException, rospy.ROSException):
            return None
        return transform.translation.x, transform.translation.y, yaw_of(transform.rotation)
