"""State of the robot for the web pages, and their commands: the ROS side, without any network of its own.

Long, but one thing after the other: all that a page can ask for and see goes through one object, which tests replace.
"""

import math
import socket
import threading
import time

import numpy as np
import rosgraph
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import BatteryState, LaserScan, Range
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.se2 import compose, pose_of, yaw_of
from robotont_driver.protocol.packet import PacketError, parse_packet
from robotont_driver.ros.publishers import DroppingPublisher
from robotont_driver.ros.worker import Worker
from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto_client import GoTo
from robotont_teleop.camera import Camera
from robotont_teleop.emergency_stop_client import EmergencyStopClient
from robotont_teleop.newest_diagnostics import SILENT, NewestDiagnostics
from robotont_teleop.page_pictures import finite, map_picture, rounded, thinned_scan
from robotont_teleop.robot_requests import NewestGoal, ServiceRequest
from robotont_teleop.speeds import STOP
from robotont_teleop.twist_message import twist_message

MAP_FRAME = "map"
STALE = 1.0             # [s] a value that has not come for so long is not shown
SLOW_PERIOD = 0.2       # [s] between two looks at transforms
MEASURED_PACKETS = 5    # over which the measured wheel speeds are averaged
SCAN_PERIOD = 0.2       # [s] between two scans for the pages
CAMERA_LOOK = 2.0       # [s] between two looks at whether there is a camera
LONGEST_WAY = 0.5       # [m] between two poses; beyond, the odometry was reset
LIGHTS, LONGEST_WORDS, RANGES = 24, 200, 16
NEVER = -math.inf


class RobotView:
    """The newest of everything. Calls by pages never wait, and whatever takes its time is never carried out late."""

    def __init__(self, wheels, camera_topic):
        self._kinematics = Kinematics(wheels)
        self._lock = threading.Lock()
        self._newest = {}      # name: (time [s], value) of values that become stale
        self._diagnostics = NewestDiagnostics()
        self._driven = 0.0     # [m]
        self._name = rospy.get_namespace().strip("/") or socket.gethostname()
        self._ranges = {}      # frame: (time [s], distance [m] or None)
        self._counts = []      # of the newest packets
        self._scan, self._scan_at = None, NEVER
        self._map, self._map_picture = None, None
        self._camera = Camera(camera_topic)
        self._map_to_odom, self._laser = None, {}
        self._frames = None    # (odom frame, base frame)
        self._driven_by = ""
        self._note = {"number": 0, "words": "", "good": True}
        self._sending = threading.RLock()
        self._ended = False
        self._transforms = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._transforms)
        self._goto = GoTo(MAP_FRAME, lambda words: self._goal.show_progress(words), self._transforms)
        self._goal = NewestGoal(self._goto, self._say)
        self._emergency_stop = EmergencyStopClient(lambda words: self._say(words, False))
        self._publish()
        rospy.on_shutdown(self._stop)
        Worker(self._look_at_transforms)
        Worker(self._look_for_camera)

    def _publish(self):
        self._command = DroppingPublisher("cmd_vel/hand", Twist)
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=5, tcp_nodelay=True)
        self._reset = ServiceRequest("reset_odometry", "reset odometry", Trigger, self._say)
        self._give_back = ServiceRequest("cmd_vel_mux/give_back", "give back", Trigger, self._say)
        for topic, kind, callback in (
                ("odom", Odometry, self._on_odometry), ("cmd_vel/limited", Twist, self._on_limited),
                ("serial_write", String, self._on_commanded), ("serial_read", String, self._on_counts),
                ("/diagnostics", DiagnosticArray, self._on_diagnostics),
                ("cmd_vel/driven_by", String, self._on_driven_by), ("battery", BatteryState, self._on_battery),
                ("range", Range, self._on_range), ("scan", LaserScan, self._on_scan),
                ("map", OccupancyGrid, self._on_map)):
            rospy.Subscriber(topic, kind, callback, queue_size=1 if topic != "/diagnostics" else 50)

    # Commands of the pages

    def send(self, twist):
        """A command by hand, (v_x [m/s], v_y [m/s], omega [rad/s])."""
        with self._sending:
            if not self._ended:
                self._command.publish(twist_message(twist))

    def _stop(self):
        """The end of the node: zero is the last command."""
        with self._sending:
            self.send(STOP)
            self._ended = True

    def press_emergency_stop(self):
        """It stays pressed until a person releases it."""
        self._emergency_stop.press()

    def release_emergency_stop(self):
        """Ask for its release, after which commands move the robot again."""
        self._emergency_stop.release()

    @property
    def stopped(self):
        """Whether the emergency stop is pressed."""
        return self._emergency_stop.pressed

    @property
    def pressed_at(self):
        """When it was pressed for the last time [s], by time.monotonic()."""
        return self._emergency_stop.pressed_at

    def cancel(self):
        """Take back every goal, whoever has sent it."""
        self._goal.cancel()
        self._cancel.publish(GoalID())

    def goal(self, x, y):
        """Send the robot to (x, y) [m] on the map; it looks in the end as it looks now."""
        pose = self._pose()
        yaw = pose[2] if pose and self._map_to_odom else 0.0
        self._goal.pursue(Goal(x, y, yaw))

    def give_back(self):
        """Let navigation drive now."""
        self._give_back.call()

    def reset_odometry(self):
        """Reset the pose."""
        self._reset.call()

    def _say(self, words, good):
        with self._lock:
            self._note = {"number": self._note["number"] + 1, "words": words[:LONGEST_WORDS], "good": good}

    # State for the pages

    def state(self):
        """Fast-changing state, for JSON."""
        with self._lock:
            return {
                "pose": rounded(self._pose(), 4), "velocity": rounded(self._fresh("velocity"), 3),
                "limited": rounded(self._fresh("limited"), 3), "commanded": rounded(self._fresh("commanded"), 3),
                "measured": rounded(self._measured(), 3), "driven_by": self._driven_by, "stopped": self.stopped,
            }

    def status(self):
        """Slow-changing state, for JSON."""
        now = time.monotonic()
        lights = self._diagnostics.lights(now)
        with self._lock:
            return {
                "frame": MAP_FRAME if self._map_to_odom else (self._frames or ("",))[0],
                "lights": lights[:LIGHTS], "board": self._diagnostics.board,
                "battery": self._fresh("battery", SILENT),
                "ranges": [value for _, (at, value) in sorted(self._ranges.items()) if now - at < STALE][:RANGES],
                "map": self._map, "camera": self._camera.present,
                "navigation": self._goto.answers, "goal": self._goal.shown,
                "note": self._note,
            }

    def figures(self):
        """What `metrics` wants."""
        now = time.monotonic()
        with self._lock:
            velocity = self._fresh("velocity")
            robot = {"name": self._name, "id": "", "present": True, "age": 0.0, "driven": self._driven,
                     "battery": self._fresh("battery", SILENT),
                     "speed": [math.hypot(*velocity[:2])] if velocity else None,
                     "stopped": self.stopped, "worst": self._diagnostics.worst(now)}
        return [robot], {self._name: self._diagnostics.values(now)}

    def scan(self):
        """The newest scan for JSON, or None."""
        return self._scan if time.monotonic() - self._scan_at < STALE else None

    def map_picture(self):
        """PNG of the map, or None."""
        return self._map_picture

    def camera_picture(self):
        """(number, JPEG) of now, or None."""
        return self._camera.picture()

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

    # Input from the robot

    def _on_odometry(self, message):
        self._frames = (message.header.frame_id, message.child_frame_id)
        twist = message.twist.twist
        pose, before = pose_of(message.pose.pose), self._newest.get("pose")
        way = math.dist(pose[:2], before[1][:2]) if before else 0.0
        self._driven += way if way < LONGEST_WAY else 0.0
        self._keep(pose=pose, velocity=(twist.linear.x, twist.linear.y, twist.angular.z))

    def _on_limited(self, message):
        self._keep(limited=(message.linear.x, message.linear.y, message.angular.z))

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
            self._map_picture, self._map = picture, described

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
            transform = self._transforms.lookup_transform(target, source, rospy.Time(0)).transform
        except (tf2_ros.TransformException, rospy.ROSException):
            return None
        return transform.translation.x, transform.translation.y, yaw_of(transform.rotation)

    def _look_for_camera(self):
        try:
            publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        except (OSError, rosgraph.MasterException):
            return CAMERA_LOOK
        self._camera.look({name for name, _ in publishers})
        self._camera.wait(CAMERA_LOOK)
        return 0.0
