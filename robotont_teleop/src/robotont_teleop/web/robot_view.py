"""A robot for the web pages: its state and their commands, without any network of its own.

All that a page can ask for and see goes through one object, which tests replace.
"""

import contextlib
import socket

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan, Range

from robotont_description.geometry import body
from robotont_driver.command.command_stream import refuse
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import ParameterError
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_driver.ros.server_parameters import running_wheels
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_map_navigation.goal import Goal
from robotont_map_navigation.goto_client import GoTo
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.movers import Movers
from robotont_teleop.hand.robot_reports import LONGEST_WORDS, RobotReports, rounded
from robotont_teleop.hand.sensor_view import reading_of
from robotont_teleop.hand.service_request import ServiceRequest
from robotont_teleop.hand.twist_publisher import TwistPublisher
from robotont_teleop.web.camera import Camera
from robotont_teleop.web.frame_chain import FrameChain
from robotont_teleop.web.newest_goal import NewestGoal
from robotont_teleop.web.page_pictures import map_picture, nearest, scan_points

MAP_FRAME = "map"
LIGHTS, MOST_KEPT = 24, 20  # lights that are shown; values, of which range sensors have one each
COMMANDS = ("cmd_vel", "cmd_vel/hand", "cmd_vel/navigation", "cmd_vel/default")
LOOK_PERIOD = 2.0  # [s] between two looks at which robot runs


class RobotView(RobotReports):
    """State and commands. Calls by pages never wait, and whatever takes its time is never carried out late."""

    def __init__(self, camera_topic):
        self._note = {"number": 0, "words": ""}  # [s] when it came; 0: none yet
        self.emergency_stop = EmergencyStopPublisher(self._say)  # first: on a slow network each takes seconds
        self._command = TwistPublisher("cmd_vel/hand")
        self.send = self._command.send
        rospy.on_shutdown(self._command.end)
        super().__init__()
        self.name = rospy.get_namespace().strip("/") or socket.gethostname()
        self.camera = Camera(camera_topic)
        self.map_picture, self._map = None, None  # PNG, where it lies
        self._body = None  # of `look`, until a robot runs
        self._frame = ""   # of the newest pose
        self._frames = FrameChain()
        self._movers = Movers(rospy.get_name(), rospy.resolve_name("cmd_vel_mux"))
        self._goto = GoTo(lambda words: self._goal.show_progress(words))
        self._goal = NewestGoal(self._goto, self._say)
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=5, tcp_nodelay=True)
        self.reset_odometry = ServiceRequest("reset_odometry", "reset odometry", self._say).call
        self.give_back = ServiceRequest("cmd_vel_mux/give_back", "give back", self._say).call
        self._frames.listen()
        for topic, kind, callback in (
                ("range", Range, self._on_range), ("scan", LaserScan, lambda scan: self._keep("scan", scan)),
                ("map", OccupancyGrid, self._on_map)):
            rospy.Subscriber(topic, kind, callback, queue_size=1)
        for topic in COMMANDS:
            rospy.Subscriber(topic, Twist, self._on_command, topic, queue_size=5)
        RepeatingThread(self._look_for_wheels)

    # Commands of the pages; `send` takes those by hand

    def cancel(self):
        """Take back every goal, whoever has sent it."""
        self._goal.cancel()
        self._cancel.publish(GoalID())

    def goal(self, x, y):
        """Send the robot to (x, y) [m] on the map; it looks in the end as it looks now."""
        frame, pose = self._pose()
        self._goal.pursue(Goal(x, y, pose[2] if frame == MAP_FRAME else 0.0))

    def _say(self, words):
        self._note = {"number": boot_time(), "words": words[:LONGEST_WORDS]}

    # State for the pages

    def state(self):
        """What changes fast, for JSON."""
        stop = self.emergency_stop
        return {"pose": rounded(self._pose()[1], 3), "velocity": rounded(self.velocity, 3),
                "driven_by": self.driven_by, "mover": self._movers.who(self.driven_by, boot_time()),
                "stopped": stop.pressed, "stop_waits": stop.waits, "pressed_here": stop.latched and not stop.waits,
                "stopped_by_class": "/fleet_node" in stop.pressed_by}

    def status(self):
        """What changes slowly, for JSON."""
        self._frame = self._pose()[0] or self._frame
        return {"frame": self._frame, "lights": self.lights[:LIGHTS], "battery": self.battery,
                "radius": self._body and self._body[0], "near": self._near(), "map": self._map, "scan": self._scan(),
                "camera": self.camera.present, "navigation": self._goto.answers, "goal": self._goal.shown,
                "note": self._note}

    def figures(self):
        """What `metrics` wants."""
        return [{**self.summary, "name": self.name, "up": self.emergency_stop.has_driver, "age": 0.0,
                 "stopped": self.emergency_stop.pressed}], {self.name: self.values}

    def _look_for_wheels(self):
        """Learn which robot runs, before or after this node was started; returns the time to rest."""
        with contextlib.suppress(OSError, ParameterError, rosgraph.MasterException):
            self._body = body(running_wheels(rospy.get_namespace()))
        return LOOK_PERIOD

    def _pose(self):
        """(frame, (x, y, yaw)) on the map where there is one, else of the odometry; ("", None) when it is unknown."""
        return self._frames.pose(self.base_frame, boot_time())

    def _scan(self):
        scan = self._fresh("scan")
        laser = scan and self._place_on_robot(scan)
        return scan_points(scan, laser) if laser else []

    def _near(self):
        heard = [self._fresh(name) for name in tuple(self._newest) if name.startswith(("scan", "range"))]
        placed = [(self._place_on_robot(one), *reading_of(one)) for one in heard if one]
        return nearest([one for one in placed if one[0]], self._body) if self._body and heard else []

    def _place_on_robot(self, message):
        """(3 x 3 rotation, (x, y, z) [m]) of a sensor, None where it is unknown."""
        frame, place = self._frames.place(message.header.frame_id, boot_time(), until=self.base_frame)
        return place if frame == self.base_frame else None

    def _on_command(self, message, topic):
        linear, angular = message.linear, message.angular
        refused = refuse((linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z))
        moves = not refused and any((linear.x, linear.y, angular.z))
        self._movers.hear(topic, connection_header(message).get("callerid", ""), moves, boot_time())

    def _on_range(self, message):
        name = f"range {message.header.frame_id}"
        if name in self._newest or len(self._newest) < MOST_KEPT:
            self._keep(name, message)

    def _on_map(self, message):
        try:
            self.map_picture, self._map = map_picture(message)
        except ValueError as error:
            rospy.logwarn("a map is not shown: %s", error)
