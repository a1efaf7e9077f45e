"""Brings one robot into a fleet: its place, battery and state out over zenoh, goals, cancels and stops in.

A process of its own, for which the driver never waits. Without a router or without zenoh the robot drives as before.
"""

import contextlib
import io
import json
import math
import queue
import secrets
import socket
import threading
import time

import rospy
from actionlib_msgs.msg import GoalStatusArray
from sensor_msgs.msg import BatteryState

from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_driver.ros.node_parameters import refuse
from robotont_driver.ros.worker import Worker
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.robot_telemetry import RobotTelemetry
from robotont_fleet.zenoh_setup import ABSENT, client_settings, open_session, read_password, send, zenoh
from robotont_teleop.web.page_setup import ros_home

PARAMETERS = (
    Parameter("robot_name", "", "in the fleet; empty: the namespace, or this computer's name"),
    Parameter("router", "tcp/127.0.0.1:7447", "of the fleet, as zenoh writes it: tcp/ADDRESS:7447"),
    Parameter("zenoh_config", "", "file of zenoh's own settings in place of router and password, as for TLS"),
)
STATE_PERIOD, PLACE_PERIOD = 0.5, 0.1  # [s] of what the robot says of itself, and of its place
OLDEST_GOAL = 2.0  # [s] one that was sent longer ago is refused
QUESTION, ANSWER = 0.5, 2.0  # [s] between two questions to the router; an answer may take


def refusal_of_age(age):
    """Why a goal that was sent `age` [s] ago is refused; empty when it is not."""
    if 0.0 <= age <= OLDEST_GOAL:
        return ""
    return "goal refused: it was sent before the connection was cut" if age == math.inf else \
        f"goal refused: it may be {age:.1f} s old, allowed: {OLDEST_GOAL:g} s"


class FleetNode:
    """The zenoh side of one robot."""

    def __init__(self, parameters):
        self._parameters = parameters
        namespace = rospy.get_namespace().strip("/").replace("/", "_")
        self.name = parameters["robot_name"] or namespace or socket.gethostname()
        self._password_file = ros_home() / "robotont_fleet_password"
        try:
            keys.check_name(self.name)
            self._password = read_password(self._password_file)
        except (ValueError, OSError) as error:
            refuse([str(error)])
        self._identity = secrets.token_hex(4)   # of this process: two robots of one name differ in it
        self._others = set()                    # identities of other processes with our name
        # Newest question to the router that was answered [s], and the way there and back: all comes in the order in
        # which the router has sent it, so that what comes behind an answer was sent after its question.
        self._asked, self._took = -math.inf, math.inf
        self._heard, self._confirmed = None, None   # number of the newest stop, and of the newest that holds
        self._note = ""
        self._arrived = queue.Queue()           # (what handles it, payload, newest answered question [s])
        self._session = None
        self._state_due = 0.0
        self._robot = RobotTelemetry()
        Health(robot_name(), {"fleet": self._report})
        if zenoh is None:
            rospy.logwarn("fleet_node: %s", ABSENT)
            return
        threading.Thread(target=self._open, daemon=True).start()

    def _open(self):
        """Find the router, however long that takes; then serve."""
        try:
            session = open_session(client_settings(self._parameters["router"], self.name, self._password),
                                   self._parameters["zenoh_config"])
        except zenoh.ZError as error:
            rospy.logerr("no fleet: %s", error)
            return
        for key, handle in ((keys.ros_key(keys.GOAL, self.name), self._on_goal),
                            (keys.ros_key(keys.CANCEL, self.name), self._on_cancel),
                            (keys.order_key(self.name), self._on_order)):
            session.declare_subscriber(key, self._receiver(handle))
        session.declare_queryable(keys.state_key(self.name), self._on_query)
        session.declare_queryable(keys.values_key(self.name), self._on_query)
        session.liveliness().declare_subscriber(keys.alive_key(self.name), self._on_namesake, history=True)
        self._token = session.liveliness().declare_token(keys.alive_key(self.name, self._identity))
        self._session = session
        rospy.on_shutdown(session.close)
        rospy.Subscriber("battery", BatteryState, self._on_battery, queue_size=1)
        rospy.Subscriber("move_base/status", GoalStatusArray, self._on_status, queue_size=1)
        Worker(self._ask)
        Worker(self._tell)
        Worker(self._obey)

    # Out

    def _put_message(self, topic, message):
        output = io.BytesIO()
        message.serialize(output)
        send(self._session, keys.ros_key(topic, self.name), output.getvalue())

    def _tell(self):
        """Send the place, and the state where it is due; returns the time to rest."""
        transforms = self._robot.transforms()
        if transforms:
            self._put_message(keys.TF, transforms)
        if time.monotonic() >= self._state_due or self._heard != self._confirmed:
            self._state_due = time.monotonic() + STATE_PERIOD
            self._tell_state()
        return PLACE_PERIOD

    def _tell_state(self):
        send(self._session, keys.state_key(self.name), self._state())

    def _state(self):
        state = self._robot.state()
        if state["stopped"] and self._heard:
            self._confirmed = self._heard
        return json.dumps({**state, "id": self._identity, "number": _milliseconds(), "note": self._note,
                           "confirmed": self._confirmed, "namesakes": len(self._others)})

    def _on_battery(self, message):
        if math.isfinite(message.percentage):  # the adapter hands it on unseen
            self._put_message(keys.BATTERY, message)

    def _on_status(self, message):
        self._put_message(keys.STATUS, message)

    def _on_query(self, query):
        if zenoh.KeyExpr(keys.state_key(self.name)).intersects(query.key_expr):
            query.reply(keys.state_key(self.name), self._state())
        if zenoh.KeyExpr(keys.values_key(self.name)).intersects(query.key_expr):
            query.reply(keys.values_key(self.name), json.dumps(self._robot.values))

    # In

    def _ask(self):
        """Ask the router, which takes one way there and back; returns the time to rest."""
        asked = time.monotonic()
        with contextlib.suppress(zenoh.ZError):
            for _ in self._session.liveliness().get(keys.alive_key(self.name, self._identity), timeout=ANSWER):
                pass
        now = time.monotonic()
        if now - asked < ANSWER:
            self._asked, self._took = asked, now - asked
        return max(0.0, QUESTION - (now - asked))

    def _receiver(self, handle):
        """Notes what has come, and how old it can be, in zenoh's own thread: in the order of arrival.

        There it may do no more: what asked zenoh for anything would wait for ever where another thread asks, too.
        """
        return zenoh.handlers.Callback(lambda sample: self._arrived.put(
            (handle, sample.payload.to_bytes(), self._asked)), indirect=False)

    def _obey(self):
        """Carry out what has come; returns the time to rest."""
        handle, payload, asked = self._arrived.get()
        try:
            handle(payload, time.monotonic() - asked)
        except Exception as error:  # whatever somebody has sent
            rospy.logwarn_throttle(10.0, "an order that is none: %r", error)
        return 0.0

    def _on_namesake(self, sample):
        identity = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.DELETE:
            self._others.discard(identity)
        elif identity != self._identity:
            self._others.add(identity)

    def _on_order(self, payload, _age):
        """An order of the fleet's page."""
        order = json.loads(payload)
        kind = order["kind"]
        if kind == "stop":
            self._stop(str(order["number"])[:40])
        elif kind == "cancel":
            self._robot.cancel()
        elif kind == "goal" and order["id"] == self._identity:
            x, y = float(order["x"]), float(order["y"])
            self._pursue((_milliseconds() - order["seen"]) / 1000, lambda: self._robot.goal_at(x, y))

    def _stop(self, number):
        """Press the emergency stop once for each number; the same one again asks for the confirmation only."""
        if number != self._heard:
            self._heard = number
            self._robot.stop()
            rospy.logwarn("emergency stop pressed by the fleet's page")
        self._tell_state()

    def _on_goal(self, payload, age):
        """A goal of free_fleet, which names no state."""
        message = keys.GOAL[1]().deserialize(payload)
        self._pursue(age, lambda: self._robot.goal(message))

    def _on_cancel(self, payload, _age):
        self._robot.cancel(keys.CANCEL[1]().deserialize(payload))

    def _pursue(self, age, send):
        """Send a goal that is fresh and cannot be meant for another robot; else say why not."""
        if self._others:
            refusal = f"goal refused: another robot is called {self.name}, too"
        else:
            refusal = refusal_of_age(age) or send()
        if refusal:
            rospy.logwarn("%s", refusal)
        self._note = refusal
        self._tell_state()

    # Health

    def _report(self):
        values = {"name": self.name, "router": self._parameters["router"]}
        if zenoh is None:
            return WARN, ABSENT, values
        if self._others:
            return ERROR, (f"another robot is called {self.name}, too: give one of them another robot_name in "
                           "config/fleet/fleet.yaml"), values
        if self._session is None or time.monotonic() - self._asked > 2 * ANSWER:
            return WARN, (f"no answer from {self._parameters['router']}: does ./robotont fleet run there, and is its "
                          f"password for {self.name} in {self._password_file}? The robot drives without it"), values
        if not self._robot.emergency_stop.has_driver:
            return ERROR, (f"no driver_node in {rospy.get_namespace()}, so no stop and no goal reaches a robot: does "
                           "it run, and in this namespace (ROS_NAMESPACE=robot1 roslaunch ...)?"), values
        values["there and back [s]"] = f"{self._took:.3f}"
        return OK, f"connected, {1000 * self._took:.0f} ms there and back", values


def _milliseconds():
    """The time since the computer's start: the number of a state. A goal names that of the state that was seen."""
    return int(1000 * time.monotonic())


def main():
    """Run fleet_node."""
    run_without_wheels("fleet_node", FleetNode, PARAMETERS)
