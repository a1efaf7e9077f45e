"""Brings one robot into a fleet: its place, battery and state out over zenoh, goals, cancels and stops in.

A process of its own, for which the driver never waits. Without a router or without zenoh the robot drives as before.
"""

import contextlib
import functools
import io
import json
import math
import secrets
import socket
import threading

import rospy
from actionlib_msgs.msg import GoalStatusArray
from sensor_msgs.msg import BatteryState

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import refuse, run_without_wheels
from robotont_driver.ros.worker import Worker
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.mailbox import Mailbox
from robotont_fleet.messages import CONFIRMED, TO_ROBOT, read_order
from robotont_fleet.robot_telemetry import RobotTelemetry
from robotont_fleet.zenoh_setup import ABSENT, client_settings, open_session, read_password, send, zenoh
from robotont_teleop.web.page_setup import ros_home

PARAMETERS = (
    Parameter("robot_name", "", "in the fleet; empty: the namespace, or this computer's name"),
    Parameter("router", "tcp/127.0.0.1:7447", "of the fleet, as zenoh writes it: tcp/ADDRESS:7447"),
)
STATE_PERIOD, PLACE_PERIOD, LEAST_PERIOD = 0.5, 0.1, 0.01  # [s] of its state, of its place, and at least of both
OLDEST = 2.0  # [s] a goal or a release that was sent longer ago is refused
LARGEST = 4096  # [bytes] of a message
QUESTION, ANSWER = 0.5, 2.0  # [s] between two questions to the router; an answer may take


def refusal_of_age(what, age):
    """Why a goal or a release that was sent `age` [s] ago is refused; empty when it is not."""
    if 0.0 <= age <= OLDEST:
        return ""
    return f"{what} refused: it was sent before the connection was cut" if age == math.inf else \
        f"{what} refused: it may be {age:.1f} s old, allowed: {OLDEST:g} s"


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
        self._held = []                         # numbers of the stops that hold, the newest last
        self._note = ""
        self._mailbox = Mailbox()               # of (what handles it, the order, newest answered question [s])
        self._session = None
        self._due, self._state_due = threading.Event(), 0.0  # of the next state: at once, and when [s]
        self._robot = RobotTelemetry(self._on_pressed_by, self._refuse)
        Health(robot_name(), {"fleet": self._report})
        if zenoh is None:
            rospy.logwarn("fleet_node: %s", ABSENT)
            return
        threading.Thread(target=self._open, daemon=True).start()

    def _open(self):
        """Find the router, however long that takes; then serve."""
        try:
            session = open_session(client_settings(self._parameters["router"], self.name, self._password))
        except zenoh.ZError as error:
            rospy.logerr("no fleet: %s", error)
            return
        session.declare_subscriber(keys.order_key(self.name), self._receiver(self._read_order))
        for kind, handle in ((keys.GOAL, self._on_goal), (keys.CANCEL, self._on_cancel)):
            read = functools.partial(self._read_message, kind, handle)
            session.declare_subscriber(keys.ros_key(kind, self.name), self._receiver(read))
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
        """Send the place, and the state where it is due; returns the time to rest when it is time for the next."""
        transforms = self._robot.transforms()
        if transforms:
            self._put_message(keys.TF, transforms)
        if self._due.is_set() or boot_time() >= self._state_due:
            self._due.clear()
            self._state_due = boot_time() + STATE_PERIOD
            send(self._session, keys.state_key(self.name), self._state())
        self._due.wait(PLACE_PERIOD)
        return LEAST_PERIOD

    def _state(self):
        confirmed = self._holding if self._robot.stopped_from_here else []
        return json.dumps({**self._robot.state(), "id": self._identity, "number": _milliseconds(), "note": self._note,
                           "confirmed": confirmed, "namesakes": len(self._others)})

    @property
    def _holding(self):
        """Numbers of the stops that hold; where a process before this one has pressed, our identity is its number."""
        return self._held or [self._identity]

    def _on_pressed_by(self, message):
        self._mailbox.put("pressed_by", (self._follow_emergency_stop, message, 0.0))  # a stop may be on its way as well

    def _follow_emergency_stop(self, _message, _age):
        if not self._robot.emergency_stop.pressed:  # somebody has released it
            self._held = []

    def _on_battery(self, message):
        if math.isfinite(message.percentage):  # the adapter hands it on unseen
            self._put_message(keys.BATTERY, message)

    def _on_status(self, message):
        self._put_message(keys.STATUS, message)

    def _on_query(self, query):
        query.reply(keys.values_key(self.name), json.dumps(self._robot.values))

    # In

    def _ask(self):
        """Ask the router, which takes one way there and back; returns the time to rest."""
        asked = boot_time()
        with contextlib.suppress(zenoh.ZError):
            for _ in self._session.liveliness().get(keys.alive_key(self.name, self._identity), timeout=ANSWER):
                pass
        now = boot_time()
        if now - asked < ANSWER and self._session.info.routers_zid():  # without a router zenoh answers itself
            self._asked, self._took = asked, now - asked
        return max(0.0, QUESTION - (now - asked))

    def _receiver(self, read):
        """Notes what has come, and how old it can be, in zenoh's own thread: in the order of arrival.

        There it may do no more: what asked zenoh for anything would wait for ever where another thread asks, too. What
        is no order ends here; read(payload) returns (its kind, what handles it, the order), or raises ValueError.
        """
        def take(sample):
            with contextlib.suppress(ValueError):
                if len(sample.payload) > LARGEST:
                    return
                kind, handle, order = read(sample.payload.to_bytes())
                self._mailbox.put(kind, (handle, order, self._asked))
        return zenoh.handlers.Callback(take, indirect=False)

    def _read_order(self, payload):
        order = read_order(payload, TO_ROBOT)
        return (order["kind"], order.get("number")), self._on_order, order

    @staticmethod
    def _read_message(kind, handle, payload):
        try:
            return kind, handle, kind[1]().deserialize(payload)
        except Exception as error:  # genpy has its own kinds for each sort of garbage
            raise ValueError(str(error)) from None

    def _obey(self):
        """Carry out what has come; returns the time to rest."""
        handle, order, asked = self._mailbox.take()
        handle(order, boot_time() - asked)
        self._due.set()
        return 0.0

    def _on_namesake(self, sample):
        identity = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.DELETE:
            self._others.discard(identity)
        elif identity != self._identity:
            self._others.add(identity)

    def _on_order(self, order, _age):
        """An order of the fleet's page."""
        if order["kind"] == "stop":
            self._stop(order["number"])
        elif order["kind"] == "cancel":
            self._robot.cancel()
        elif order["id"] == self._identity:
            age = (_milliseconds() - order["seen"]) / 1000
            if order["kind"] == "goal":
                self._pursue(age, lambda: self._robot.goal_at(order["x"], order["y"]))
            else:
                self._refuse(refusal_of_age("release", age) or self._release(order["number"]))

    def _stop(self, number):
        """Press the emergency stop, and again where somebody has released it; what is pressed already is confirmed."""
        if number not in self._held:
            self._held = [*self._held[1 - CONFIRMED:], number]
            rospy.logwarn("emergency stop pressed by the fleet's page")
        elif self._robot.stopped_from_here:
            return
        self._robot.stop()

    def _release(self, number):
        """End one stop; returns why the robot does not go by that, or ""."""
        if number not in self._holding:
            return "not released: it was released already"
        if len(self._held) > 1:
            self._held = [one for one in self._held if one != number]
            return "not released: it was stopped again meanwhile, or by another fleet's page"
        return self._robot.release()

    def _on_goal(self, message, age):
        """A goal of free_fleet, which names no state."""
        self._pursue(age, lambda: self._robot.goal(message))

    def _on_cancel(self, message, _age):
        self._robot.cancel(message)

    def _pursue(self, age, send):
        """Send a goal that is fresh and cannot be meant for another robot."""
        if self._others:
            self._refuse(f"goal refused: another robot is called {self.name}, too")
        else:
            self._refuse(refusal_of_age("goal", age) or send())

    def _refuse(self, why):
        """Tell why something is refused; "": it is not."""
        if why:
            rospy.logwarn_throttle_identical(1.0, why)
        self._note = why

    # Health

    def _report(self):
        values = {"name": self.name, "router": self._parameters["router"]}
        if zenoh is None:
            return WARN, ABSENT, values
        if self._others:
            return ERROR, (f"another robot is called {self.name}, too: give one of them another robot_name in "
                           "config/fleet/fleet.yaml"), values
        if self._session is None or boot_time() - self._asked > 2 * ANSWER:
            return WARN, (f"no answer from {self._parameters['router']}: does ./robotont fleet run there, and is its "
                          f"password for {self.name} in {self._password_file} since before fleet.launch? "
                          "The robot drives without it"), values
        if not self._robot.emergency_stop.has_driver:
            return ERROR, (f"no driver_node in {rospy.get_namespace()}, so no stop and no goal reaches a robot: does "
                           "it run, and in this namespace (fleet.launch namespace:=robot1)?"), values
        values["there and back [s]"] = f"{self._took:.3f}"
        return OK, f"connected, {1000 * self._took:.0f} ms there and back", values


def _milliseconds():
    """The time since the computer's start: the number of a state. A goal names that of the state that was seen."""
    return int(1000 * boot_time())


def main():
    """Run fleet_node."""
    run_without_wheels("fleet_node", FleetNode, PARAMETERS)
