"""Where something holds the robot, navigation stands, and then its goal ends: it must not push what it does not see."""

import cmath
import contextlib
import math
import time
from collections import deque

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from std_msgs.msg import Float32, String

from robotont_driver.kinematics.se2 import between
from robotont_driver.ros.diagnostics import ERROR, OK, Health, robot_name
from robotont_map_navigation.readings import Newest, needed_radius, place_of

LAG = 0.08      # [s] from a command until the wheels of robots with our firmware, also with 8 kg, move at MOVES of it
MAKERS = 0.2, 0.08  # LAG and LEAST of robots with their makers' firmware: it begins late, and creeps by fits and starts
FELT = 0.14     # [s] without the motion that is commanded, after which something may hold the robot: it stands ...
STAND = 0.5     # [s] ... for so long, and tries again; a stalled computer looks the same, once
TRIES = 3       # such stands without FREE between them, and something holds the robot
FREE = 0.05     # [m] driven as commanded, a turn as of LEAST, after which the stands before do not count
LEAST = 0.04    # [m/s], a turn by the speed on the circle that move_base keeps free; slower commands prove nothing
MOVES = 0.4     # of the commanded motion at least
SILENCE = 0.5   # [s] without a measured twist or a command, and nothing is known
MOST_COMMANDS = 100  # that are kept where no twist comes
NOTHING = 0.0, 0.0, 0.0
WAY, TURN, WHOLE = slice(2), slice(2, 3), slice(3)  # of a twist
# [rad] from the direction of travel, where it may be: so little that a camera at the front sees past it, or no scan
# would ever clear it
FRONT = -0.1, 0.0, 0.1
PASSED = 0.05, 5.0  # [m] driven, or [s] gone by, since a touch, after which nothing is barred any more


class HoldWatch:
    """Compares what is commanded with what the wheels measure; without ROS.

    radius: [m] by which a turn counts as a speed; lag [s], least [m/s]: LAG, LEAST. Twists are (v_x [m/s], v_y [m/s],
    omega [rad/s]). Times [s]: `now`, of this computer; `stamp`, when a twist was measured, on the same clock.
    """

    def __init__(self, radius, lag=LAG, least=LEAST):
        self._radius, self.lag, self.least = radius, lag, least
        self.turn_alone = False             # whether at the newest stand the way was as commanded
        self._commands = deque([(-math.inf, NOTHING)], MOST_COMMANDS)  # (time, speeds [m/s]), the newest last
        self._measured = -math.inf, -math.inf  # (stamp, time of arrival) of the newest twist
        self._since = None                  # as above, since when the robot does not move as commanded
        self._stands_until = -math.inf
        self._tries, self._way = 0, 0.0     # stands, and [m] driven as commanded since

    def command(self, twist, now):
        """What goes out to the wheels for navigation; (0, 0, 0) where something else drives."""
        self._commands.append((now, self._speeds(twist)))

    def _speeds(self, twist):
        return twist[0], twist[1], twist[2] * self._radius  # [m/s]: a turn counts by the speed of the wheels

    def measure(self, twist, stamp, now):
        """(whether to stand for STAND, why the motion ends or "") by a twist, the mean since the stamp before."""
        before, self._measured = self._measured, (stamp, now)
        step = stamp - before[0]
        known = 0.0 < step < SILENCE and now - before[1] < SILENCE
        if not known or now - self._commands[-1][0] > SILENCE or now < self._stands_until:
            self._since = None
            return False, ""
        newest = self._commands[-1][1]
        while len(self._commands) > 1 and self._commands[1][0] <= before[0] - self.lag:
            self._commands.popleft()  # the first one left is that which counted then
        measured = self._speeds(twist)
        lagging = [part for part in (WAY, TURN, WHOLE) if self._lags(part, newest, measured)]
        if not lagging:
            self._since = None
            self._way += max(0.0, _along(newest, measured)) * step
            if self._way > FREE:
                self._tries = 0
            return False, ""
        self._since = self._since or (before[0], now)  # the stamp's whole step was without motion; its news is new
        if min(stamp - self._since[0], now - self._since[1]) < FELT:
            return False, ""
        part, self.turn_alone = lagging[0], lagging[0] == TURN
        length, moved = math.hypot(*newest[part]), _along(newest[part], measured[part])
        self._since, self._stands_until = None, now + STAND
        self._tries, self._way = self._tries % TRIES + 1, 0.0
        does, moves, unit = ("turn", "turned", "rad/s") if self.turn_alone else ("move", "moved", "m/s")
        size = self._radius if self.turn_alone else 1.0
        words = (f"something holds the robot: {TRIES} times it was to {does} at {length / size:.2f} {unit}, and its "
                 f"wheels {moves} it at {moved / size:.2f} {unit}; look before it and at its wheels")
        return True, (words if self._tries == TRIES else "")

    def _lags(self, part, newest, measured):
        """Whether the whole, the way, or the turn stays behind what has been commanded: one may hide the other."""
        asked = min(_along(newest[part], speeds[part]) for _, speeds in self._commands)
        return asked >= self.least and _along(newest[part], measured[part]) < MOVES * asked


class Held:
    """Where the robot does not move as navigation commands, `navigation/stand` lets it stand for a moment.

    The costmaps are told what it has touched, and `navigation/barred` keeps it from leaning on that while it turns to
    go around it.
    Where that happens again and again, every goal is cancelled; `navigation/held` tells why.
    """

    def __init__(self, frames, felt):
        """felt: `Felt`."""
        self._frames, self._felt, self._watch = frames, felt, HoldWatch(needed_radius(), *lag_and_least())
        # where there is no mux to tell it is navigation
        self._driver = Newest("cmd_vel/driven_by", String, String("navigation"), tcp_nodelay=True)
        self._words, self._command = "", NOTHING
        self._touched = 0j, 0j, -math.inf  # where the robot was, and the way [unit vector], x + iy of odom; [s] when
        self._stand = rospy.Publisher("navigation/stand", Float32, queue_size=1, tcp_nodelay=True)
        self._barred = rospy.Publisher("navigation/barred", Vector3, queue_size=1, tcp_nodelay=True)
        self._told = rospy.Publisher("navigation/held", String, queue_size=1, latch=True)
        self._told.publish("")
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=1)
        self._seen = 0.0, NOTHING  # stamp [s] and pose in the odometry's frame, of the newest look
        rospy.Subscriber("cmd_vel/limited", Twist, self._on_command, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("move_base/current_goal", PoseStamped, self._on_goal, queue_size=1)
        Health(robot_name(), {"motion": self._report})

    def _on_goal(self, _):
        """Try anew; the robot may have been started since, or be another one."""
        self._tell("")
        with contextlib.suppress(OSError, rospy.ROSException):  # the master is gone
            self._watch.lag, self._watch.least = lag_and_least()

    def _on_command(self, message):
        drives = self._driver.message.data == "navigation"
        self._command = (message.linear.x, message.linear.y, message.angular.z) if drives else NOTHING
        self._watch.command(self._command, time.monotonic())
        if self._command != NOTHING:
            self._look()
        if self._words and self._driver.message.data in ("hand", "default"):  # who drives it away: it is free
            self._tell("")

    def _look(self):
        """Compare what the odometry, by tf that this process reads anyway, measured since the look before."""
        found = self._frames.look_up(self._frames.odometry, self._frames.base)
        (before, start), stamp = self._seen, found and found.header.stamp.to_sec()
        if not found or stamp == before:
            return
        x, y, yaw = pose = place_of(found)
        self._seen = stamp, pose
        measured = [part / (stamp - before) for part in between(start, pose)]
        now = time.monotonic()
        age = max(0.0, rospy.get_time() - stamp)  # another computer's clock may be ahead
        lost = complex(*self._command[:2]) - complex(*measured[:2])  # [m/s]: towards what holds the robot ...
        lost *= abs(lost) > self._watch.least and not self._watch.turn_alone  # ... if it is not a turn that is held
        stand, words = self._watch.measure(measured, now - age, now)
        place, turned = complex(x, y), cmath.rect(1.0, yaw)
        if stand:
            self._stand.publish(STAND)
            self._touched = place, lost and lost / abs(lost) * turned, now
            # of a turn on the spot nobody knows where
            self._felt.tell([cmath.phase(lost) + side for side in FRONT if lost])
        before, way, since = self._touched
        if abs(place - before) < PASSED[0] and now - since < PASSED[1]:
            way /= turned
            self._barred.publish(Vector3(way.real, way.imag, 0.0))
        if words:
            rospy.logwarn("navigation ends its goal: %s", words)
            self._tell(words)  # first: who has sent the goal asks why it ended
            self._cancel.publish(GoalID())

    def _tell(self, words):
        self._words = words
        self._told.publish(words)

    def _report(self):
        return ERROR if self._words else OK, self._words or "as commanded", {"driven by": self._driver.message.data}


def lag_and_least():
    """Of the robot that the parameters tell of."""
    board = rospy.get_param("serial_com_node/packets", rospy.get_param("robot", ""))  # driver_basic.launch: robot
    return MAKERS if board in ("robotont2", "robotont3") else (LAG, LEAST)


def _along(way, speeds):
    """[m/s] of speeds along a way; 0 along none."""
    return sum(a * b for a, b in zip(way, speeds)) / (math.hypot(*way) or 1.0)
