"""The ROS side of cmd_vel_mux: commands of several senders in, one cmd_vel out."""

import math
import threading
from functools import partial

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import Float32, String
from std_srvs.srv import Trigger, TriggerResponse

from robotont_driver.command.command_age import Arrivals
from robotont_driver.command.command_stream import refuse
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_driver.ros.server_parameters import KeptParameter, kept_names
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_driver.rospy_repairs.topic_reconnection import Reconnector, is_local
from robotont_teleop.hand.twist_publisher import TwistPublisher
from robotont_teleop.mux.arbitration import STOP, Arbiter, Input
from robotont_teleop.mux.guard_sensors import make_guard

PARAMETERS = (
    Parameter("hand_timeout", 0.3, "the robot stops after this long without a command of the hand that drives", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when the hand's node dies"),
    Parameter("hand_rest", 2.0, "after the last motion by hand, hand_timeout at least, before others may drive", "s",
              minimum=0.0, maximum=60.0),
    Parameter("navigation_timeout", 0.5, "the robot stops after this long without a command of navigation", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when navigation dies"),
    Parameter("blind_speed", 0.3, "of the hand where no scan and no range sees, if there is either; elsewhere the hand "
              "stops before what is in the way; negative: no guard", "m/s", minimum=-1.0, maximum=100.0),
)
STAND_FIRST = "cmd_vel_mux_held"  # parameter: a restarted node knows who has to stop first
NAVIGATION_REST = 1.0    # [s] after the last motion by navigation, before the default may drive
DEFAULT_TIMEOUT = 0.5    # [s] without a command of the default, after which the robot stops
HELD = 1.0               # [s] for which it is told what was in the way
LOOK_PERIOD = 0.02       # [s] between two looks at who has fallen silent, at most
GUARD_PERIOD = 0.1       # [s] between two looks at what the guard has to tell
LONGEST_STAND = 2.0      # [s] for which navigation can be told to stand; more is a mistake
BARRED = 1.0             # [s] for which a way is barred to navigation, when nothing more is heard of it
ASIDE, STRAIGHT = 0.4, 0.9  # cosines of the angle to that way: less and a motion passes it, more and it tries
LITTLE = 0.05            # [rad/s] a slower turn is none
PUBLISHERS_PERIOD = 2.0  # [s] between two looks at who else publishes cmd_vel


class CmdVelMux:
    """Lets the highest input drive; none while driver_node says that the emergency stop is pressed."""

    def __init__(self, parameters):
        inputs = (Input("hand", parameters["hand_timeout"], parameters["hand_rest"]),  # the highest first
                  Input("navigation", parameters["navigation_timeout"], NAVIGATION_REST, zeros_of_all=True),
                  Input("default", DEFAULT_TIMEOUT, 0.0))
        self._arbiter = Arbiter(inputs, kept_names(STAND_FIRST), boot_time())
        self._lock = threading.Lock()
        self._held = KeptParameter(STAND_FIRST, lambda: self._arbiter.held(boot_time()))
        self._timeouts = {name: timeout for name, timeout, *_ in inputs}
        self._refusal = ""
        heard = []  # subscribers of commands
        self._arrivals = Arrivals(min(self._timeouts.values()), boot_time(), partial(is_local, heard))
        self._outdated = 0
        self._driver = None
        self._others = ()  # who publishes on cmd_vel, past this mux
        self._pressed_by = ""  # who presses the emergency stop
        self._barred = STOP, -math.inf  # unit vector on the robot, where navigation may not go; [s] of its message
        self._blind_speed = parameters["blind_speed"]
        self._guard = make_guard(self._blind_speed)  # None where it is off, or as long as there is no robot
        self._guard_worries = False
        self._guarded = STOP    # the newest command, as the guard has let it through
        self._publisher = TwistPublisher("cmd_vel")
        self._driven_by = rospy.Publisher("cmd_vel/driven_by", String, queue_size=1, latch=True)
        self._cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=1)
        self._tell_driver()
        rospy.on_shutdown(self._publisher.end)
        self._driver_node = rospy.Subscriber("emergency_stop/pressed_by", String, self._on_pressed_by, tcp_nodelay=True)
        heard += [rospy.Subscriber("cmd_vel/" + name, Twist, partial(self._on_command, name), queue_size=1,
                                   tcp_nodelay=True) for name in self._timeouts]
        rospy.Subscriber("navigation/stand", Float32, self._on_stand, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("navigation/barred", Vector3, self._on_barred, queue_size=1, tcp_nodelay=True)
        RepeatingThread(Reconnector(boot_time, [*heard, self._driver_node]).look)
        rospy.Service("~give_back", Trigger, self._on_give_back)
        RepeatingThread(self._look_for_others)
        self._health = Health(robot_name(), {"who drives": self._report,
                                             **({"guard": self._report_guard} if self._blind_speed >= 0.0 else {})})
        RepeatingThread(self._look)
        RepeatingThread(self._watch_guard)  # last: it tells the diagnostics what a sensor has that came before it

    def _on_command(self, name, message):
        linear, angular = message.linear, message.angular
        refusal = refuse((linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z))
        twist = STOP if refusal else (linear.x, linear.y, angular.z)
        with self._lock:
            now, header = boot_time(), connection_header(message)
            if not self._arrivals.are_new(header, now) and twist != STOP:
                self._outdated += 1
                return
            twists = self._arbiter.command(name, twist, now, header.get("callerid", ""))
            stopped_meanwhile = boot_time() - now >= self._timeouts[name]  # this process, since it has judged the age
            self._send([STOP] if stopped_meanwhile else twists)
            in_vain = name == "navigation" and self._arbiter.locked and twist != STOP
            if refusal:
                self._refusal = f"cmd_vel/{name}: {refusal}"
        if in_vain:  # a goal that was sent during the stop, and would move the robot after it
            self._cancel.publish(GoalID())
        self._tell_driver()

    def _on_pressed_by(self, message):
        with self._lock:
            before, self._pressed_by = self._pressed_by, message.data
            self._send(self._arbiter.emergency_stop(bool(message.data), boot_time()))
        if message.data or before:  # every goal: move_base would drive on; at the end those that it has got meanwhile
            self._cancel.publish(GoalID())
        self._held.changed()
        self._tell_driver()

    def _on_stand(self, message):
        if 0.0 < message.data <= LONGEST_STAND:
            with self._lock:
                self._send(self._arbiter.stand("navigation", message.data, boot_time()))

    def _on_barred(self, message):
        if math.hypot(message.x, message.y) < 1.01:
            self._barred = (message.x, message.y), boot_time()

    def _on_give_back(self, _request):
        with self._lock:
            self._send(self._arbiter.give_back(boot_time()))
            driver = self._arbiter.driver
        self._tell_driver()
        return TriggerResponse(success=True, message=f"{driver} drives")

    def _look(self):
        """Whatever silence makes due; returns the time to rest."""
        with self._lock:
            now = boot_time()
            self._arrivals.gaps.tick(now)
            self._send(self._arbiter.look(now) or self._slower(now))
            left = self._arbiter.time_left(now)
        self._tell_driver()
        return LOOK_PERIOD if left is None else min(left, LOOK_PERIOD)

    def _send(self, twists):
        for twist in twists:
            self._guarded = self._allowed(twist, boot_time())
            self._publisher.send(self._guarded)

    def _allowed(self, twist, now):
        """What may go out of a twist. Behind the arbiter: a zero that comes of it is none of its sender."""
        driver = self._arbiter.driver
        if driver == "hand" and self._guard:
            return self._guard.limit(twist, now)
        return beside(twist, self._barred[0]) if driver == "navigation" and now - self._barred[1] < BARRED else twist

    def _slower(self, now):
        """[the hand's newest command], when the guard allows less of it by now than it did."""
        if not self._guard or self._arbiter.driver != "hand":
            return []
        twist = self._arbiter.sent
        if math.hypot(*self._guard.limit(twist, now)) >= 0.98 * math.hypot(*self._guarded):
            return []
        return [twist if boot_time() - now < self._timeouts["hand"] else STOP]  # this process may have been stopped

    def _watch_guard(self):
        """Tell soon that something is in the way, or that a sensor cannot be used; returns the time to rest."""
        worries = self._blind_speed >= 0.0 and self._report_guard()[0] != OK
        if worries != self._guard_worries:
            self._guard_worries = worries
            self._health.publish_now()
        return GUARD_PERIOD

    def _tell_driver(self):
        with self._lock:
            driver = self._arbiter.driver
            if driver == self._driver:
                return
            self._driver = driver
            self._driven_by.publish(driver)
        rospy.loginfo("the mux lets drive: %s", driver)

    def _look_for_others(self):
        """Find other publishers of cmd_vel, and a robot that came later, or is another; returns the time to rest."""
        try:
            self._guard = make_guard(self._blind_speed, self._guard)
            publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        except (OSError, rosgraph.MasterException):
            return PUBLISHERS_PERIOD  # the master is gone; the robot is not
        topic = rospy.resolve_name("cmd_vel")
        nodes = {node for name, names in publishers if name == topic for node in names}
        self._others = tuple(sorted(nodes - {rospy.get_name()}))
        return PUBLISHERS_PERIOD

    def _report(self):
        now = boot_time()
        with self._lock:
            arbiter = self._arbiter
            driver, barred = arbiter.driver, arbiter.barred(now)
            ignored = [f"{sender} on cmd_vel/{name}, which {owner} has until it stops"
                       for name, sender, owner in arbiter.ignored(now)]
            values = {
                "drives": driver,
                "commands too old": self._outdated,
                "times that this node was stopped or starved": self._arrivals.gaps.amount,
                "stops because a driver fell silent": arbiter.timeouts,
                "other publishers of cmd_vel": ", ".join(self._others) or "none",
            }
            refusal, self._refusal = self._refusal, ""
            pressed_by = self._pressed_by if arbiter.locked else ""
        warnings = (
            # this project's driver_node alone publishes who presses the stop
            not self._driver_node.get_num_connections() and "no driver_node of this project hears its commands",
            pressed_by and f"emergency stop, pressed by {pressed_by}",
            self._others and (driver in self._timeouts or len(self._others) > 1) and
            f"{', '.join(self._others)} also on cmd_vel: commands may mix (cmd_vel:=cmd_vel/default)",
            ignored and "ignored: " + "; ".join(ignored),
            refusal and "command refused: " + refusal,
            barred and f"a sender on {', '.join('cmd_vel/' + name for name in barred)} must stop once after the "
                       f"emergency stop before driving; or call {rospy.get_name()}/give_back",
        )
        words = next(filter(None, warnings), "")
        also = f" by hand or goal; on cmd_vel: {', '.join(self._others)}" if self._others else ""
        return (WARN, words, values) if words else (OK, f"drives: {driver}{also}", values)

    def _report_guard(self):
        if not self._guard:
            return WARN, "cannot be used: no robot's wheels on the parameter server: does not interfere", {}
        with self._lock:
            now, held = boot_time(), self._guard.held
            well, words = self._guard.report(now)
        if held and now - held[0] < HELD:
            return WARN, held[1], {"sight": words}
        return OK if well else WARN, words, {}


def beside(twist, way):
    """A twist that does not lean on what lies in a `way` (x, y of a unit vector): it turns first, then goes past.

    All of it where it leads straight there without a turn: whether it can shows by trying.
    """
    x, y, turn = twist
    share = (x * way[0] + y * way[1]) / max(math.hypot(x, y), 1e-9)
    tries = share > STRAIGHT and abs(turn) < LITTLE
    return (0.0, 0.0, turn) if share > ASIDE and not tries else twist


def main():
    """Run cmd_vel_mux."""
    run_without_wheels("cmd_vel_mux", CmdVelMux, PARAMETERS)
