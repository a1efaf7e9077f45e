"""The ROS side of cmd_vel_mux: commands of several senders in, one cmd_vel out."""

import threading
import time
from functools import partial

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger, TriggerResponse

from robotont_driver.command_stream import refuse
from robotont_driver.driver_node import PRESSED
from robotont_driver.node import OK, WARN, DroppingPublisher, Health, Worker, robot_name, run_without_wheels
from robotont_driver.outages import OutageWatch
from robotont_driver.parameters import Parameter
from robotont_driver.refusals import Refusals
from robotont_driver.stall_watch import StallWatch
from robotont_teleop.arbitration import STOP, Arbiter, Input
from robotont_teleop.twist_message import twist_message

PARAMETERS = (
    Parameter("hand_timeout", 0.3, "the robot stops after this long without a command of the hand that drives", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when the hand's node dies"),
    Parameter("hand_rest", 2.0, "after the last motion by hand, before the inputs below it may drive", "s",
              minimum=0.0, maximum=60.0),
    Parameter("navigation_timeout", 0.5, "the robot stops after this long without a command of navigation", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when navigation dies"),
    Parameter("navigation_rest", 1.0, "after the last motion by navigation, before the default may drive", "s",
              minimum=0.0, maximum=60.0),
    Parameter("default_timeout", 0.5, "the robot stops after this long without a command of the default", "s",
              minimum=0.05, maximum=2.0,
              reason="for so long the robot drives on when the default's node dies"),
)
INPUTS = ("hand", "navigation", "default")  # highest first
ZEROS_OF_ALL = ("navigation",)  # the node unblock stops for move_base
LOOK_PERIOD = 0.02       # [s] between two looks at who has fallen silent, at most
PUBLISHERS_PERIOD = 2.0  # [s] between two looks at who else publishes cmd_vel


class CmdVelMux:
    """Lets the highest input drive, and keeps the state of the emergency stop for whoever starts later."""

    def __init__(self, parameters):
        self._arbiter = Arbiter([
            Input(name, parameters[name + "_timeout"], parameters.get(name + "_rest", 0.0), name in ZEROS_OF_ALL)
            for name in INPUTS])
        self._lock = threading.Lock()
        self._telling, self._saving = threading.Lock(), threading.Lock()
        self._commands = dict.fromkeys(INPUTS, 0)
        self._refusals = Refusals()
        self._refusal = ""
        self._stalls = StallWatch(min(parameters[name + "_timeout"] for name in INPUTS) / 2, time.monotonic())
        self._outdated = 0
        self._driver = None
        self._others = ()
        self._publisher = DroppingPublisher("cmd_vel", Twist)
        self._driven_by = rospy.Publisher("cmd_vel/driven_by", String, queue_size=1, latch=True)
        self._emergency_stop = rospy.Publisher("emergency_stop", Bool, queue_size=1, latch=True)
        self._saved = False  # value of the parameter
        if rospy.get_param(PRESSED, False) is True:  # a mux before this one has left it
            self._press(True)
        self._tell_driver()
        Worker(self._look)
        rospy.on_shutdown(self._stop)
        emergency_stop = rospy.Subscriber(
            "emergency_stop", Bool, self._on_emergency_stop, queue_size=1, tcp_nodelay=True)
        inputs = [rospy.Subscriber("cmd_vel/" + name, Twist, partial(self._on_command, name), queue_size=1,
                                   tcp_nodelay=True) for name in INPUTS]
        OutageWatch(newest=inputs, every=[emergency_stop])
        rospy.Service("~give_back", Trigger, self._on_give_back)
        Worker(self._look_for_others)
        Health(robot_name(), {"who drives": self._report})

    def _on_command(self, name, message):
        linear, angular = message.linear, message.angular
        refusal = refuse((linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z))
        twist = STOP if refusal else (linear.x, linear.y, angular.z)
        with self._lock:
            now = time.monotonic()
            self._commands[name] += 1
            if twist != STOP and self._stalls.earliest_arrival(now) < now:
                self._outdated += 1  # it waited while this node was stopped or starved
                return
            before = self._arbiter.driver
            self._send(self._arbiter.command(name, twist, now, message._connection_header.get("callerid", "")))
            changed = before != self._arbiter.driver
            news = refusal and self._refusals.refuse((name, refusal.split()[0]), now)
            if refusal:
                self._refusal = f"cmd_vel/{name}: {refusal}"
        if changed:
            self._tell_driver()
        if news:
            rospy.logwarn("cmd_vel/%s refused: %s", name, refusal)

    def _on_emergency_stop(self, message):
        if message._connection_header.get("callerid") != rospy.get_name():
            self._press(message.data)

    def _press(self, pressed):
        """Lock or unlock; then repeat the state, latched, for nodes that start later.

        Of a press and a release at once, in a thread each, the later one is what is repeated and kept, too.
        """
        with self._lock:
            self._send(self._arbiter.emergency_stop(pressed, time.monotonic()))
        with self._telling:
            self._emergency_stop.publish(self._arbiter.locked)
        self._tell_driver()
        with self._saving:
            pressed = self._arbiter.locked
            if pressed != self._saved:
                self._saved = pressed
                try:
                    rospy.set_param(PRESSED, pressed)
                except OSError as error:  # no master: the stop holds, but would not survive a restart
                    rospy.logerr("emergency stop not kept on the parameter server: %s", error)

    def _on_give_back(self, _request):
        with self._lock:
            self._send(self._arbiter.give_back(time.monotonic()))
            driver = self._arbiter.driver
        self._tell_driver()
        return TriggerResponse(success=True, message=f"{driver} drives")

    def _look(self):
        """Whatever silence makes due; returns the time to rest."""
        with self._lock:
            now = time.monotonic()
            self._stalls.tick(now)
            self._send(self._arbiter.look(now))
            left = self._arbiter.time_left(now)
        self._tell_driver()
        return LOOK_PERIOD if left is None else min(left, LOOK_PERIOD)

    def _send(self, twists):
        for twist in twists:
            self._publisher.publish(twist_message(twist))

    def _tell_driver(self):
        with self._lock:
            driver = self._arbiter.driver
            if driver == self._driver:
                return
            self._driver = driver
            self._driven_by.publish(driver)
        rospy.loginfo("drives: %s", driver)

    def _look_for_others(self):
        """Find other publishers of cmd_vel; returns the time to rest."""
        try:
            publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        except (OSError, rosgraph.MasterException):
            return PUBLISHERS_PERIOD  # the master is gone; the robot is not
        topic = rospy.resolve_name("cmd_vel")
        nodes = {node for name, names in publishers if name == topic for node in names}
        others = tuple(sorted(nodes - {rospy.get_name()}))
        if others and others != self._others:
            rospy.logwarn("%s publish%s straight to %s, past this mux: let them publish on cmd_vel/navigation or "
                          "cmd_vel/default (e.g. rosrun ... cmd_vel:=cmd_vel/default)",
                          " and ".join(others), "" if len(others) > 1 else "es", topic)
        self._others = others
        return PUBLISHERS_PERIOD

    def _stop(self):
        with self._lock:
            if self._arbiter.driver in INPUTS:
                self._send([STOP])

    def _report(self):
        now = time.monotonic()
        with self._lock:
            arbiter = self._arbiter
            driver, waiting, barred = arbiter.driver, arbiter.waiting(now), arbiter.barred(now)
            ignored = [f"{sender} on cmd_vel/{name}, which {owner} has until it stops"
                       for name, sender, owner in arbiter.ignored(now)]
            values = {
                "drives": driver,
                "wait": ", ".join(waiting) or "nobody",
                **{f"commands of {name}": count for name, count in self._commands.items()},
                "ignored": "; ".join(ignored) or "nobody",
                "commands refused": self._refusals.amount,
                "commands too old": self._outdated,
                "times that this node was stopped or starved": self._stalls.stalls,
                "stops because a driver fell silent": arbiter.timeouts,
                "other publishers of cmd_vel": ", ".join(self._others) or "none",
            }
            refusal, self._refusal = self._refusal, ""
            locked = arbiter.locked
        if locked:
            return WARN, "emergency stop: publish false on emergency_stop to release it", values
        if self._others:
            return WARN, f"{', '.join(self._others)} also on cmd_vel: commands may mix; use cmd_vel/default", values
        if ignored:
            return WARN, "ignored: " + "; ".join(ignored), values
        if refusal:
            return WARN, "command refused: " + refusal, values
        if barred:
            return WARN, (f"{', '.join(barred)} must stop once after the emergency stop before driving; or call "
                          f"{rospy.get_name()}/give_back"), values
        return OK, f"drives: {driver}", values


def main():
    """Run cmd_vel_mux."""
    run_without_wheels("cmd_vel_mux", CmdVelMux, PARAMETERS)
