"""Brings one robot into a fleet: its state out over zenoh, goals, cancels and stops in.

A process of its own, for which the driver never waits. Without a router or without zenoh the robot drives as before.
"""

import contextlib
import json
import queue
import secrets
import socket
import threading

import rospy

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import refuse, run_without_wheels
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.messages import CONFIRMED, TO_ROBOT, read_order
from robotont_fleet.robot_telemetry import RobotTelemetry
from robotont_fleet.zenoh_setup import ABSENT, client_settings, open_session, read_password, send, zenoh
from robotont_teleop.web.page_setup import ros_home

PARAMETERS = (
    Parameter("robot_name", "", "in the fleet; empty: the namespace, or this computer's name"),
    Parameter("router", "tcp/127.0.0.1:7447", "of the fleet, as zenoh writes it: tcp/ADDRESS:7447"),
)
STATE_PERIOD, LEAST_PERIOD = 0.5, 0.01  # [s] of its state, and at least where something has changed
NOTED = 15.0  # [s] for which it is told why an order was refused
WAITING = 1000  # orders that have come; beyond, one is dropped: a stop is sent again
OLDEST = 2.0  # [s] a goal or a release that was sent longer ago is refused


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
            keys.check_router(parameters["router"])
        except (ValueError, OSError) as error:
            refuse([str(error)])
        self._identity = secrets.token_hex(4)   # of this process: two robots of one name differ in it
        self._others = set()                    # identities of other processes with our name
        self._held = []                         # numbers of the stops that hold, the newest last
        self._note, self._noted = "", 0.0       # why the newest order was refused, and when [s]
        self._orders = queue.Queue(WAITING)     # that wait to be carried out
        self._session = None
        self._due = threading.Event()           # the next state, at once
        self._robot = RobotTelemetry(self._on_pressed_by, self._refuse)
        RepeatingThread(self._obey)             # also without a router: who presses is told all the same
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
        session.declare_subscriber(keys.order_key(self.name), zenoh.handlers.Callback(self._take, indirect=False))
        session.liveliness().declare_subscriber(keys.alive_key(self.name), self._on_namesake, history=True)
        self._token = session.liveliness().declare_token(keys.alive_key(self.name, self._identity))
        self._session = session
        rospy.on_shutdown(session.close)
        RepeatingThread(self._tell)

    # Out

    def _tell(self):
        """Send the state, now and then or where it has changed; returns the time to rest."""
        self._due.clear()
        send(self._session, keys.state_key(self.name), self._state())
        self._due.wait(STATE_PERIOD)
        return LEAST_PERIOD

    def _state(self):
        confirmed = self._holding if self._robot.stopped_from_here else []
        note = self._note if boot_time() - self._noted < NOTED else ""
        return json.dumps({**self._robot.state(), "id": self._identity, "number": _milliseconds(), "note": note,
                           "confirmed": confirmed, "namesakes": len(self._others)})

    @property
    def _holding(self):
        """Numbers of the stops that hold; where a process before this one has pressed, our identity is its number."""
        return self._held or [self._identity]

    def _on_pressed_by(self, _message):
        self._orders.put({"kind": "pressed_by"})  # a stop may be on its way as well

    # In

    def _take(self, sample):
        """Note what has come, in zenoh's own thread; what is no order ends here.

        There it may do no more: what asked zenoh for anything would wait for ever where another thread asks, too.
        """
        with contextlib.suppress(ValueError, queue.Full):
            self._orders.put_nowait(read_order(sample.payload, TO_ROBOT))

    def _obey(self):
        """Carry out what has come; returns the time to rest."""
        self._on_order(self._orders.get())
        self._due.set()
        return 0.0

    def _on_namesake(self, sample):
        identity = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.DELETE:
            self._others.discard(identity)
        elif identity != self._identity:
            self._others.add(identity)

    def _on_order(self, order):
        kind = order["kind"]
        if kind == "pressed_by":
            if not self._robot.emergency_stop.pressed:  # somebody has released it
                self._held, self._note = [], ""
        elif kind == "stop":
            self._stop(order["number"])
        elif kind == "cancel":
            self._robot.cancel()
        elif order["id"] == self._identity:
            age = (_milliseconds() - order["seen"]) / 1000  # [s]
            late = "" if 0.0 <= age <= OLDEST else f"{kind} refused: it may be {age:.1f} s old, allowed: {OLDEST:g} s"
            self._refuse(late or (self._pursue(order) if kind == "goal" else self._release(order["number"])))

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

    def _pursue(self, order):
        """Go there, unless the goal may be meant for another robot; returns why not, or ""."""
        if self._others:
            return f"goal refused: another robot is called {self.name}, too"
        return self._robot.goal(order["x"], order["y"])

    def _refuse(self, why):
        """Tell why something is refused; "": it is not."""
        if why:
            rospy.logwarn_throttle_identical(1.0, why)
        self._note, self._noted = why, boot_time()

    # Health

    def _report(self):
        values = {"name": self.name, "router": self._parameters["router"]}
        if zenoh is None:
            return WARN, ABSENT, values
        if self._others:
            return ERROR, f"another robot is called {self.name}, too: rename one of them (docs/fleet.md)", values
        if self._session is None or not self._session.info.routers_zid():
            return WARN, (f"no answer from {self._parameters['router']}: does ./robotont fleet run there, and is its "
                          f"password for {self.name} in {self._password_file} since before fleet.launch? "
                          "The robot drives without it"), values
        if not self._robot.emergency_stop.has_driver:
            return ERROR, (f"no driver_node in {rospy.get_namespace()}, so no stop and no goal reaches a robot: does "
                           "it run, and in this namespace (fleet.launch namespace:=robot1)?"), values
        return OK, "connected", values


def _milliseconds():
    """The time since the computer's start: the number of a state. A goal names that of the state that was seen."""
    return int(1000 * boot_time())


def main():
    """Run fleet_node."""
    run_without_wheels("fleet_node", FleetNode, PARAMETERS)
