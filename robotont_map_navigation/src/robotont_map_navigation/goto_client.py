"""Goals for move_base, for `goto` and the page: sent, watched, cancelled, and their outcome."""

import functools
import math
import threading
import time
from typing import NamedTuple

import actionlib
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String

from robotont_driver.kinematics.se2 import compose, pose_of, yaw_of
from robotont_driver.rospy_repairs.rospy_internals import connection_header, goal_id
from robotont_map_navigation.footprint import base_frame, needed_radius
from robotont_map_navigation.goal import (
    GAVE_UP,
    INTERRUPTED,
    LOST,
    NOT_THERE,
    REFUSED,
    REPLACED,
    TOO_LONG,
    Goal,
    Outcome,
    outcome,
    progress,
    remaining,
)
from robotont_map_navigation.goal_check import refusal
from robotont_map_navigation.messages import floor_map_of

SILENCE = 3.0      # [s] without a status of move_base, which sends five per second, and it is gone
LOOK_UP = 0.4      # [s] that the map and then the transforms have to come; without them a goal is not checked
STAYS = 0.5        # [m] a robot that stays in a circle as small gets nowhere
PATIENCE = 60.0    # [s] for which a goal may wait where the robot gets nowhere
AGAIN = 1.0        # [s] after move_base has given up, until it gets the goal once more
NEWS = 3.0         # [s] for which a word of the diagnostics counts
CANCELLING = 20.0  # [s] that move_base has to confirm a cancellation: it hears of none while it turns around, 10 s
GOING_ON = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


class Pursuit(NamedTuple):
    """A goal that has been sent."""

    goal: Goal
    start: float  # [s] time.monotonic() when it was sent


class GoTo:
    """Sends a goal and watches it; the next one replaces it. What the map shows to be out of reach is never sent."""

    def __init__(self, frame, show):
        """frame: of the goals; show: called with lines of progress."""
        self._frame = frame
        self._show = show
        self._transforms = None         # tf2_ros.Buffer, from the first goal on
        self._map = None                # nav_msgs/OccupancyGrid
        self._floor_map = (None, None)  # the message, and the FloorMap that is made of it at the first goal
        self._map_came = threading.Event()
        self._trouble = ""  # why the robot's pose is wrong, of navigation_monitor
        self._doubt = ""    # why it may be
        self._held = ""     # what has ended navigation's motion since this goal was sent, of navigation_monitor
        self._pressed_by = ""  # who presses the emergency stop, which cancels all goals
        self._stopped_by = ""  # who has pressed it since this one was sent
        self._overruled = ""   # who else has cancelled all goals since, or has sent one
        self._pose = None
        self._comparable = False  # whether that pose is in the frame of the goals
        self._sent = set()  # ids of the goals of this client that move_base has not reported as ended
        self._ended = threading.Event()  # one for each goal
        self._ended.set()                # nothing is pursued yet
        self._handle = None              # actionlib.ClientGoalHandle of the goal that was sent last
        self._left = False
        self._lock = threading.Lock()
        self._ills = {}  # name of a diagnostics' task: (time [s], level, words) where it complains
        self._heard = -math.inf
        # not SimpleActionClient: it passes over the end of a goal that ends before its handle has been returned
        self._client = actionlib.ActionClient("move_base", MoveBaseAction)
        rospy.Subscriber("move_base/status", GoalStatusArray, self._on_status, queue_size=1)
        rospy.Subscriber("map", OccupancyGrid, self._on_map, queue_size=1)
        rospy.Subscriber("localization/trouble", String, self._on_trouble, queue_size=1)
        rospy.Subscriber("localization/doubt", String, self._on_doubt, queue_size=1)
        rospy.Subscriber("navigation/held", String, self._on_held, queue_size=1)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=10)
        rospy.Subscriber("emergency_stop/pressed_by", String, self._on_pressed_by, queue_size=10)
        rospy.Subscriber("move_base/cancel", GoalID, self._on_cancel, queue_size=10)
        rospy.Subscriber("move_base/goal", MoveBaseActionGoal, self._on_goal, queue_size=10)

    @property
    def answers(self):
        """Whether move_base has been heard lately."""
        return time.monotonic() - self._heard <= SILENCE

    def wait_for_server(self, timeout):
        """Whether move_base answers within `timeout` [s]."""
        end = time.monotonic() + timeout
        while not self._client.wait_for_server(rospy.Duration(0.2)):
            if time.monotonic() > end:
                return False
        return True

    def go(self, goal, timeout, patience=PATIENCE):
        """Send the robot to a Goal; its Outcome, after `timeout` [s] at the latest (0: no limit).

        Where the robot gets nowhere the goal waits for `patience` [s], and goes on by itself; with 0 move_base decides.
        """
        return self.check(goal) or self.follow(self.send(goal), timeout, patience)

    def check(self, goal):
        """The Outcome of a Goal that the map shows to be out of reach, or that a release would begin; else None."""
        start = time.monotonic()
        self._stopped_by = self._pressed_by
        reason = self._refusal(goal)
        if self._stopped_by:
            reason = f"the emergency stop, pressed by {self._stopped_by}: release it, then send the goal again"
        if self._trouble:
            return self._lost()
        return Outcome(REFUSED, f"refused after {time.monotonic() - start:.1f} s: {reason}") if reason else None

    def send(self, goal):
        """Send the robot to a Goal, in place of the one before; a Pursuit to follow."""
        message = MoveBaseGoal()
        target = message.target_pose
        target.header.frame_id, target.header.stamp = self._frame, rospy.Time.now()
        target.pose.position.x, target.pose.position.y = goal.x, goal.y
        target.pose.orientation.z, target.pose.orientation.w = math.sin(goal.yaw / 2), math.cos(goal.yaw / 2)
        self._heard = time.monotonic()
        self._pose = None
        self._ended = threading.Event()
        self._left = False
        self._held = self._overruled = ""
        self._stopped_by = self._pressed_by
        self._handle = self._client.send_goal(message, functools.partial(_note_end, self._ended), self._on_feedback)
        self._sent.add(goal_id(self._handle))
        return Pursuit(goal, self._heard)

    def follow(self, pursuit, timeout, patience=PATIENCE):
        """The Outcome of the goal that was sent last; `timeout` and `patience` as of `go`."""
        goal, start = pursuit
        place, since = None, start  # in the circle around it the robot has been since then
        try:
            while True:
                now, pose = time.monotonic(), self._pose
                if pose and (place is None or math.dist(place, pose[:2]) > STAYS):
                    place, since = pose[:2], now
                if self._ended.wait(0.1):
                    found = self._end(goal, start)
                    if not self._may_go_on(found) or now - since > patience:
                        return found
                    self._wait_and_send_again(goal, found, now - since, patience)
                    continue
                if now - since > patience > 0.0:
                    return self._stays(goal, now - since)
                self._show(progress(self._pose, goal, now - start))
                if self._trouble:
                    return self._lost()
                if now - self._heard > SILENCE:
                    self._take_back()  # should it only be slow
                    return Outcome(NOT_THERE, f"move_base has not been heard for {SILENCE:g} s: has it died?")
                if timeout and now - start > timeout:
                    return Outcome(TOO_LONG, f"not there after {timeout:g} s; {self.cancel()}")
        except KeyboardInterrupt:
            return Outcome(INTERRUPTED, f"interrupted; {self.cancel()}")

    def _may_go_on(self, found):
        """Whether what made move_base give up may pass: a door, a cable, a sensor; not who holds or stops it."""
        return found.status == GAVE_UP and not self._held and not self._stopped_by

    def _wait_and_send_again(self, goal, found, waited, patience):
        end = time.monotonic() + AGAIN
        while time.monotonic() < end and not self._must_not_drive():
            self._show(f"waits, {waited:.0f} of {patience:.0f} s: {self._cause() or found.words}")
            time.sleep(0.1)
        with self._lock:
            if not self._must_not_drive():
                self.send(goal)

    def _must_not_drive(self):
        """Whether a goal that waits, of which move_base knows nothing, has been taken back or stopped meanwhile."""
        return self._left or self._stopped_by or self._overruled

    def _cause(self):
        """The worst that the robot's nodes say of themselves; empty when all is well."""
        oldest = time.monotonic() - NEWS
        ills = [ill for ill in tuple(self._ills.values()) if ill[0] > oldest]
        return max(ills, key=lambda ill: ill[1])[2] if ills else ""

    def _stays(self, goal, seconds):
        left = remaining(self._pose, goal) if self._pose and self._comparable else None
        words = f"; {left[0]:.2f} m and {left[1]:.2f} rad were left" if left else ""
        return Outcome(GAVE_UP, f"got nowhere for {seconds:.0f} s: does something stand in the way, or on the goal? "
                       f"{self.cancel()}{words}{self._doubts()}")

    def _end(self, goal, start):
        """The Outcome of a goal that has ended."""
        if self._left:
            return Outcome(REPLACED, "cancelled")
        if self._trouble:
            return self._lost()
        if self._held:
            return Outcome(GAVE_UP, f"{self._held}; the goal is cancelled")
        if self._stopped_by and self._handle.get_goal_status() in (GoalStatus.PREEMPTED, GoalStatus.RECALLED):
            return Outcome(REPLACED, f"cancelled by the emergency stop, pressed by {self._stopped_by}: release it, "
                           "then send the goal again")
        found = outcome(GoalStatus.to_string(self._handle.get_goal_status()), self._handle.get_goal_status_text(), goal,
                        self._pose if self._comparable else None, time.monotonic() - start)
        if found.status == GAVE_UP and self._overruled:
            return Outcome(REPLACED, f"{self._overruled}, while it waited: {found.words}")
        return found._replace(words=found.words + self._doubts()) if found.status == GAVE_UP else found

    def _doubts(self):
        """Words to a goal that was not reached."""
        return self._doubt and f"; {self._doubt}. Was the robot carried? Then start relocalize"

    def _lost(self):
        self._take_back()
        return Outcome(LOST, f"the robot does not know where it is, the goal is cancelled: {self._trouble}; start "
                       "relocalize, or set the pose by RViz' 2D Pose Estimate")

    def leave(self, cancel=False):
        """Make `follow` return, from another thread; the robot goes on to its goal unless that is to `cancel`."""
        with self._lock:  # no goal is sent again once this has been said
            if cancel:
                self._take_back()
            self._left = True
            self._ended.set()

    def cancel(self):
        """Take the goal back; returns a sentence on whether move_base confirms it. Ctrl-C ends the wait for that."""
        self._take_back()
        start = time.monotonic()
        waited = 0.0
        try:
            while not self._ended.wait(0.1):
                waited = time.monotonic() - start
                if waited > CANCELLING or not self.answers:
                    break
                if waited > 1.0:
                    self._show(f"{waited:4.0f} s  cancelled; not confirmed yet: move_base ends its recovery first")
        except KeyboardInterrupt:
            pass
        if self._ended.is_set():
            return "the goal is cancelled"
        return f"cancelled, but move_base has not confirmed it within {waited:.0f} s: the robot may still move"

    def _take_back(self):
        """Cancel every goal of this client that may go on.

        Where a cancellation overtakes its goal on the way, move_base never begins that goal, nor ends the one before.
        """
        for sent in tuple(self._sent):
            self._client.pub_cancel.publish(GoalID(id=sent))

    def _refusal(self, goal):
        """Why the map shows that the goal cannot be reached; None when it can, or when there is no map to tell."""
        if not self._map_came.wait(LOOK_UP):
            return None
        message = self._map
        if self._floor_map[0] is not message:
            self._floor_map = message, floor_map_of(message)
        if self._transforms is None:
            self._transforms = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._transforms)
        frame = message.header.frame_id
        place = (goal.x, goal.y, goal.yaw)
        if self._frame != frame:
            above = self._look_up(frame, self._frame)
            if above is None:
                return None
            place = compose(above, place)
        start = self._look_up(frame, base_frame())
        return refusal(self._floor_map[1], place[:2], start and start[:2], needed_radius())

    def _look_up(self, frame, child):
        """Pose (x, y, yaw) of one frame in another; None when it is not known."""
        try:
            found = self._transforms.lookup_transform(frame, child, rospy.Time(), rospy.Duration(LOOK_UP)).transform
        except tf2_ros.TransformException:
            return None
        return found.translation.x, found.translation.y, yaw_of(found.rotation)

    def _on_trouble(self, message):
        self._trouble = message.data

    def _on_doubt(self, message):
        self._doubt = message.data

    def _on_diagnostics(self, message):
        own = rospy.get_namespace()[1:]
        for status in message.status:
            if status.name.startswith(own):
                self._ills[status.name] = time.monotonic(), status.level, f"{status.name}: {status.message}"
                if status.level == DiagnosticStatus.OK:
                    del self._ills[status.name]

    def _on_held(self, message):
        self._held = message.data

    def _on_pressed_by(self, message):
        self._pressed_by = message.data
        self._stopped_by = message.data or self._stopped_by

    def _on_cancel(self, message):
        if not message.id:  # all goals
            self._overrule("cancelled by", message)

    def _on_goal(self, message):
        self._overrule("replaced by a goal of", message)

    def _overrule(self, what, message):
        sender = connection_header(message).get("callerid")
        if sender != rospy.get_name():
            self._overruled = f"{what} {sender}"

    def _on_map(self, message):
        self._map = message
        self._map_came.set()

    def _on_status(self, message):
        self._heard = time.monotonic()
        self._sent.difference_update(
            status.goal_id.id for status in message.status_list if status.status not in GOING_ON)

    def _on_feedback(self, _handle, feedback):
        position = feedback.base_position
        self._pose = Goal(*pose_of(position.pose))
        self._comparable = position.header.frame_id.lstrip("/") == self._frame.lstrip("/")


def _note_end(ended, handle):
    """Called at each change of a goal's state, also before `send_goal` has returned its handle."""
    if handle.get_comm_state() == actionlib.CommState.DONE:
        ended.set()
