"""Goals for move_base, for `goto` and the page: sent, watched, cancelled, and their outcome."""

import math
import threading
import time

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import Header, String

from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.rospy_repairs.rospy_internals import goal_id
from robotont_map_navigation.goal import Outcome, Status, outcome, progress
from robotont_map_navigation.readings import Newest, floor_map_of, message_of, needed_radius
from robotont_map_navigation.tool import wait_for

FRAME = "map"      # of the goals
SILENCE = 3.0      # [s] without a status of move_base, which sends five per second, and it is gone
LOOK_UP = 0.4      # [s] that the map has to come; without it a goal is not checked
HEARD = 1.0        # [s] likewise, for who presses the emergency stop
STAYS = 0.5        # [m] a robot that stays in a circle as small gets nowhere
PATIENCE = 60.0    # [s] for which a goal may wait where the robot gets nowhere
LOOK = 8.0         # [s] of that, and since the last look, after which the robot looks around ...
TURN = 1.0         # [rad/s] ... by a turn on the spot
NO_CAUSE = ": black box", ": fleet", ": gamepad", ": guard", ": web page"  # ends of tasks that navigation does not need
NEWS = 3.0         # [s] for which a word of the diagnostics counts
PERIOD = 1.0       # [s] between two lines of progress
AGAIN = 0.5        # [s] at least between two goals that are the same
CANCELLING = 5.0   # [s] that move_base has to confirm a cancellation: it hears of none while it plans
STOP = "the emergency stop, pressed by {}: release it, then send the goal again"


class GoTo:
    """Sends a goal and watches it; the next one replaces it. None is sent where the map has no room for the robot."""

    def __init__(self, show):
        """show: called with lines of progress."""
        self._show = show
        self._map = Newest("map", OccupancyGrid)
        self._trouble = Newest("localization/trouble", String, String())  # why the pose is wrong, of navigation_monitor
        self._status = Newest("move_base/status", GoalStatusArray, GoalStatusArray())
        self._cancelled = Newest("move_base/cancel", GoalID)  # also by others
        self._pose = None      # (x [m], y [m], yaw [rad]) of the robot on the map, by move_base
        self._held = ""        # what has ended navigation's motion since this goal was sent, of navigation_monitor
        self._pressed_by = None  # who presses the emergency stop, which cancels all goals; None: not heard yet
        self._stopped_by = ""  # who has pressed it since this one was sent
        self._handle = None    # actionlib.ClientGoalHandle of the goal that was sent last ...
        self._sent = -math.inf  # [s] ... then
        self._left = False
        self._lock = threading.Lock()
        self._reports = {}     # name of a diagnostics' task: (time [s], level, words)
        self._command = rospy.Publisher("cmd_vel/navigation", Twist, queue_size=1)
        # not SimpleActionClient: it passes over the end of a goal that ends before its handle has been returned
        self._client = actionlib.ActionClient("move_base", MoveBaseAction)
        rospy.Subscriber("navigation/held", String, self._on_held, queue_size=10)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=10)
        rospy.Subscriber("emergency_stop/pressed_by", String, self._on_pressed_by, queue_size=10)

    @property
    def answers(self):
        """Whether move_base has been heard, or sent a goal, lately."""
        return time.monotonic() - max(self._status.came, self._sent) <= SILENCE

    def wait_for_server(self, timeout):
        """Whether move_base answers within `timeout` [s]."""
        return self._client.wait_for_server(rospy.Duration(max(timeout, 0.01)))

    def go(self, goal, patience=PATIENCE):
        """Send the robot to a Goal; its Outcome.

        Where the robot gets nowhere the goal waits for `patience` [s], and goes on by itself; with 0 move_base decides.
        """
        refused = self.check(goal)
        if not refused:
            self.send(goal)
        return refused or self.follow(goal, patience)

    def check(self, goal):
        """The Outcome of a Goal where the map has no room, or that a release would begin; else None."""
        self._stopped_by = self._pressed_by or ""
        wait_for(lambda: self._pressed_by is not None, HEARD)
        wait_for(lambda: self._map.message, LOOK_UP)
        floor_map = self._map.message and floor_map_of(self._map.message)
        refusal = floor_map and floor_map.frame == FRAME and floor_map.refusal(goal[:2], needed_radius())
        reason = STOP.format(self._stopped_by) if self._stopped_by else refusal
        if self._trouble.message.data:
            return self._by_others()
        return Outcome(Status.REFUSED, f"refused: {reason}") if reason else None

    def send(self, goal):
        """Send the robot to a Goal, in place of the one before; then `follow` it."""
        target = PoseStamped(Header(0, rospy.Time.now(), FRAME), message_of(goal))
        self._sent = time.monotonic()
        self._left = False
        self._held = ""
        self._stopped_by = self._pressed_by or ""
        self._handle = self._client.send_goal(MoveBaseGoal(target), feedback_cb=self._on_feedback)

    def follow(self, goal, patience=PATIENCE):
        """The Outcome of the goal that was sent last; `patience` as of `go`."""
        start = since = time.monotonic()
        told = looked = -math.inf
        place, given_up = None, ""  # in the circle around it the robot has been since then; why move_base gave up there
        try:
            while True:
                ended, now, pose = wait_for(self._has_ended, 0.1), time.monotonic(), self._pose
                if pose and (place is None or math.dist(place, pose[:2]) > STAYS):
                    place, since, given_up = pose[:2], now, ""
                waited = now - since
                over = waited > patience and now - looked > LOOK  # what a look has found is tried
                if ended:
                    time.sleep(max(0.0, self._sent + AGAIN - now))
                found = self._end(goal, now - start) if ended else self._by_others()
                if found and (found.status != Status.GAVE_UP or self._held or over):
                    return found
                if found and self._is_replaced():
                    return Outcome(Status.REPLACED, "cancelled by somebody, or another goal has taken its place")
                if found and min(waited, now - looked) > LOOK:
                    self._look_around()
                    looked = time.monotonic()
                    continue
                with self._lock:
                    if found and not self._left:  # what made move_base give up may pass: a door, a cable, a sensor
                        given_up = found.words
                        self.send(goal)
                if over and patience > 0.0:
                    return Outcome(Status.GAVE_UP, f"got nowhere for {waited:.0f} s: does something stand in the way, "
                                   f"or on the goal? {self.cancel()}{self._cause('; ')}")
                if now - told >= PERIOD:
                    told = now
                    self._show(f"waits, {min(waited, patience):.0f} of {patience:.0f} s: "
                               f"{self._cause() or given_up}" if given_up
                               else progress(pose, goal, now - start))
                if not self.answers:
                    self._take_back()  # should it only be slow
                    return Outcome(Status.NOT_THERE, f"move_base has not been heard for {SILENCE:g} s: has it died?")
        except KeyboardInterrupt:
            return Outcome(Status.INTERRUPTED, f"interrupted; {self.cancel()}")
        except BaseException:  # nobody reads what `show` prints, for instance
            self._take_back()
            raise

    def _look_around(self):
        """Turn once: who stood where the camera does not look would bar the way for ever, also when gone."""
        self._show("looks around")
        end = time.monotonic() + 2 * math.pi / TURN
        try:
            while time.monotonic() < end and not (self._left or self._is_replaced() or self._by_others()):
                self._command.publish(Twist(angular=Vector3(z=TURN)))
                time.sleep(0.1)
        finally:
            self._command.publish(Twist())

    def _cause(self, before=""):
        """The worst that the robot's nodes say of themselves, behind words; empty when all is well."""
        ills = [report for name, report in tuple(self._reports.items()) if not name.endswith(NO_CAUSE)
                and time.monotonic() - report[0] < NEWS and report[1] != DiagnosticStatus.OK]
        return before + max(ills, key=lambda ill: ill[1])[2] if ills else ""

    def _has_ended(self):
        """Whether move_base has ended the goal that was sent last, or somebody has left it."""
        return self._left or self._handle.get_comm_state() == actionlib.CommState.DONE

    def _is_replaced(self):
        """Whether somebody has cancelled this goal while it waits, or move_base pursues one of somebody else."""
        own, cancelled = goal_id(self._handle), self._cancelled
        return (cancelled.came > self._sent and cancelled.message.id in ("", own)) or any(
            one.status in (GoalStatus.PENDING, GoalStatus.ACTIVE) and one.goal_id.id != own
            for one in self._status.message.status_list)

    def _end(self, goal, elapsed):
        """The Outcome of a goal that has ended."""
        if self._left:
            return Outcome(Status.REPLACED, "cancelled")
        found = outcome(GoalStatus.to_string(self._handle.get_goal_status()), self._handle.get_goal_status_text(), goal,
                        self._pose, elapsed)
        if found.status == Status.GAVE_UP:
            found = found._replace(words=found.words + self._cause("; "))
        may_be_theirs = self._trouble.message.data or found.status in (Status.GAVE_UP, Status.REPLACED)
        return (may_be_theirs and self._by_others()) or found

    def _by_others(self):
        """The Outcome of a goal that must not go on, whatever becomes of it at move_base; None where it may."""
        found, trouble = None, self._trouble.message.data
        if trouble:
            found = Outcome(Status.LOST, "the robot does not know where it is, the goal is cancelled: "
                            f"{trouble}; start relocalize, or set the pose by RViz' 2D Pose Estimate")
        elif self._held:
            found = Outcome(Status.GAVE_UP, f"{self._held}; the goal is cancelled")
        elif self._stopped_by:
            found = Outcome(Status.REPLACED, "cancelled by " + STOP.format(self._stopped_by))
        if found:
            self._take_back()
        return found

    def leave(self, cancel=False):
        """Make `follow` return, from another thread; the robot goes on to its goal unless that is to `cancel`."""
        with self._lock:  # no goal is sent again once this has been said
            if cancel:
                self._take_back()
            self._left = True

    def cancel(self):
        """Take the goal back; returns a sentence on whether move_base confirms it."""
        self._take_back()
        if wait_for(self._has_ended, CANCELLING):
            return "the goal is cancelled"
        return f"cancelled, but move_base has not confirmed it within {CANCELLING:g} s: the robot may still move"

    def _take_back(self):
        """Cancel whatever makes move_base drive, and the newest goal by name: it may have been overtaken on the way."""
        self._client.cancel_all_goals()
        if self._handle:
            self._client.pub_cancel.publish(GoalID(id=goal_id(self._handle)))

    def _on_held(self, message):
        self._held = message.data

    def _on_diagnostics(self, message):
        own = rospy.get_namespace()[1:]
        for status in message.status:
            robot = status.hardware_id.strip("/") + "/"  # another one's, perhaps
            if status.name.startswith(own) and not (robot != own and status.name.startswith(robot)):
                self._reports[status.name] = time.monotonic(), status.level, f"{status.name}: {status.message}"

    def _on_pressed_by(self, message):
        self._pressed_by = message.data
        self._stopped_by = message.data or self._stopped_by

    def _on_feedback(self, _handle, feedback):
        self._pose = pose_of(feedback.base_position.pose)
