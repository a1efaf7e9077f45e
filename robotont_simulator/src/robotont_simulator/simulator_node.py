"""The ROS side of the simulator: ground truth and a laser scan out; faults in."""

import math
import threading

import numpy as np
import rospy
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse

from robotont_driver.node import run_node
from robotont_driver.parameters import Parameter
from robotont_simulator.official_firmware import FIRMWARES, OfficialFirmware, make_simulation
from robotont_simulator.port import Port
from robotont_simulator.simulated_board import SimulatedBoard, SimulatedFirmware
from robotont_simulator.simulation import GOOD, REVERSED, UNPLUGGED, Simulation
from robotont_simulator.world import World, WorldError, read_world

PARAMETERS = (
    Parameter("port", "/tmp/robotont", "name under which the board's serial port appears"),
    Parameter("firmware", "own", "what runs on the board: this project's firmware, or the official one of a generation",
              choices=FIRMWARES),
    Parameter("world", "", "file of walls and boxes; empty: nothing but a floor"),
    Parameter("start_x", math.nan, "start position; nan: the world's", "m"),
    Parameter("start_y", math.nan, "start position; nan: the world's", "m"),
    Parameter("start_yaw", math.nan, "start direction; nan: the world's", "rad"),
    Parameter("seed", 0, "of everything random: encoder offsets and spoilt bytes"),
    Parameter("gearbox", 18.75, "gearboxReductionRatio of the simulated motors", minimum=1.0),
    Parameter("world_frame", "map", "frame of the ground truth"),
    Parameter("base_frame", "base_link", "child frame of the ground truth"),
    Parameter("laser_frame", "laser", "frame of the scan"),
    Parameter("scan_rate", 10.0, "scans per second; 0 = off", "Hz", minimum=0.0),
    Parameter("scan_field_of_view", 1.03, "centred on forward; 6.2831853 for all around", "rad", minimum=0.1),
    Parameter("scan_rays", 128, "measurements per scan", minimum=2),
    Parameter("scan_nearest", 0.3, "nearer things read -inf (REP 117)", "m", minimum=0.0),
    Parameter("scan_farthest", 4.0, "farther things are not seen", "m", minimum=0.1),
)


class SimulatorNode:
    """Runs the firmware on the simulated board in real time, in a thread of its own."""

    def __init__(self, wheels, parameters):
        self._parameters = parameters
        world = self._read_world()
        self._simulation = self._make_simulation(wheels, world)
        self._port = Port(parameters["port"], parameters["seed"])
        self._lock = threading.Lock()
        self._orders = []  # functions to call between two periods
        self._ticks = 0
        self._prepare_messages(wheels)
        self._truth_publisher = rospy.Publisher("ground_truth/odom", Odometry, queue_size=10)
        self._scan_publisher = rospy.Publisher("scan", LaserScan, queue_size=2)
        rospy.Service("~unplug", SetBool, self._on_unplug)
        rospy.Subscriber("~byte_errors", Float32, self._on_byte_errors)
        rospy.Subscriber("~wheel_grip", Float32MultiArray, self._on_wheel_grip)
        rospy.Subscriber("~push", Vector3, self._on_push)
        rospy.Subscriber("~battery", Float32, self._on_battery)
        rospy.Subscriber("~encoders", Int8MultiArray, self._on_encoders)
        rospy.Subscriber("~motors", Int8MultiArray, self._on_motors)
        rospy.Subscriber("~jam", Int8MultiArray, self._on_jam)
        rospy.Service("~brown_out", Trigger, self._on_brown_out)
        self._firmware = self._make_firmware(wheels)
        self._thread = threading.Thread(target=self._run, daemon=True)
        rospy.on_shutdown(self._stop)
        self._thread.start()
        rospy.loginfo("a board at %s", parameters["port"])

    def _make_simulation(self, wheels, world):
        given = self._parameters
        if given["firmware"] == "own":
            return Simulation(wheels, given["gearbox"], world, given["seed"])
        try:
            return make_simulation(wheels, given["gearbox"], world, given["seed"])
        except ValueError as error:
            rospy.logfatal("firmware %s: %s", given["firmware"], error)
            raise SystemExit(1) from None

    def _make_firmware(self, wheels):
        """An object with start() and run()."""
        name = self._parameters["firmware"]
        if name != "own":
            return OfficialFirmware(name, self._simulation, self._port, self._on_tick)
        board = SimulatedBoard(self._simulation, self._port, self._on_tick, real_time=True)
        return SimulatedFirmware(board)

    def _read_world(self):
        given = self._parameters
        try:
            world = read_world(given["world"]) if given["world"] else World((), (0.0, 0.0, 0.0))
        except (OSError, WorldError) as error:
            rospy.logfatal("world: %s", error)
            raise SystemExit(1) from None
        start = (given["start_x"], given["start_y"], given["start_yaw"])
        return world._replace(start=tuple(
            own if math.isnan(value) else value for value, own in zip(start, world.start)))

    def _prepare_messages(self, wheels):
        given = self._parameters
        self._truth = Odometry(child_frame_id=given["base_frame"])
        self._truth.header.frame_id = given["world_frame"]
        field, rays = given["scan_field_of_view"], given["scan_rays"]
        self._angles = np.linspace(-field / 2, field / 2, rays, endpoint=field < 2 * math.pi - 1e-6)
        self._scan = LaserScan(
            angle_min=self._angles[0], angle_max=self._angles[-1], angle_increment=self._angles[1] - self._angles[0],
            range_min=given["scan_nearest"], range_max=given["scan_farthest"])
        self._scan.header.frame_id = given["laser_frame"]
        rate = given["scan_rate"]
        self._scan_ticks = max(1, round(wheels.pid_frequency / rate)) if rate else 0

    def _run(self):
        self._firmware.start()
        self._firmware.run()

    def _on_tick(self):
        """Between two periods: carry out orders, publish; whether to go on."""
        with self._lock:
            orders, self._orders = self._orders, []
        for order in orders:
            order()
        self._ticks += 1
        stamp = rospy.Time.now()
        self._publish_truth(stamp)
        if self._scan_ticks and self._ticks % self._scan_ticks == 0:
            self._publish_scan(stamp)
        return not rospy.is_shutdown()

    def _publish_truth(self, stamp):
        truth = self._truth
        truth.header.stamp = stamp
        x, y, yaw = self._simulation.pose()
        truth.pose.pose.position.x, truth.pose.pose.position.y = x, y
        truth.pose.pose.orientation.z, truth.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        twist = truth.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = self._simulation.twist()
        self._truth_publisher.publish(truth)

    def _publish_scan(self, stamp):
        scan = self._scan
        scan.header.stamp = stamp
        scan.ranges = self._simulation.scan(self._angles, scan.range_min, scan.range_max).tolist()
        self._scan_publisher.publish(scan)

    def _order(self, function, *arguments):
        with self._lock:
            self._orders.append(lambda: function(*arguments))

    def _on_unplug(self, request):
        self._order(self._port.unplug if request.data else self._port.plug)
        return SetBoolResponse(success=True, message="unplugged" if request.data else "plugged in")

    def _on_byte_errors(self, message):
        if check("byte_errors", message.data, 0.0, 1.0):
            self._port.byte_errors = message.data

    def _on_wheel_grip(self, message):
        """One part (0..1) of the normal friction per wheel."""
        self._order_for_wheels("wheel_grip", message.data, 0, 1, self._simulation.set_grip)

    def _on_encoders(self, message):
        """Per wheel 1: good, 0: unplugged, -1: counts backwards."""
        states = {1: GOOD, 0: UNPLUGGED, -1: REVERSED}
        self._order_for_wheels("encoders", message.data, -1, 1,
                               lambda wheel, value: self._simulation.set_encoder(wheel, states[value]))

    def _on_motors(self, message):
        """Per wheel 1: connected, 0: gets no current."""
        self._order_for_wheels("motors", message.data, 0, 1,
                               lambda wheel, value: self._simulation.set_motor(wheel, bool(value)))

    def _on_jam(self, message):
        """Per wheel 1: held fast, 0: free."""
        self._order_for_wheels("jam", message.data, 0, 1,
                               lambda wheel, value: self._simulation.set_jam(wheel, bool(value)))

    def _order_for_wheels(self, name, values, lowest, highest, function):
        """Call function(wheel, value) for each wheel, between two periods."""
        if len(values) != self._simulation.wheels.amount:
            rospy.logwarn("~%s: found %d numbers, allowed: %d", name, len(values), self._simulation.wheels.amount)
        elif all(check(name, value, lowest, highest) for value in values):
            for wheel, value in enumerate(values):
                self._order(function, wheel, value)

    def _on_brown_out(self, _request):
        """Let the board's supply break down for half a second."""
        if not isinstance(self._firmware, SimulatedFirmware):
            return TriggerResponse(success=False, message="only with ~firmware own")
        self._order(self._firmware.fail)
        return TriggerResponse(success=True, message="the board starts anew in half a second")

    def _on_push(self, message):
        """An impulse: x, y [N s] along the world's axes, z [N m s] around the vertical."""
        if all(check("push", value, -100.0, 100.0) for value in (message.x, message.y, message.z)):
            self._order(self._simulation.push, message.x, message.y, message.z)

    def _on_battery(self, message):
        """The battery's voltage [V]."""
        if check("battery", message.data, 0.0, 17.0):
            self._order(setattr, self._simulation, "voltage", message.data)

    def _stop(self):
        self._thread.join(1.0)
        self._port.unplug()


def check(name, value, lowest, highest):
    """Whether a number may be used; if not, say so."""
    good = lowest <= value <= highest
    if not good:
        rospy.logwarn("~%s: found %s, allowed: %g to %g", name, value, lowest, highest)
    return good


def main():
    """Run simulator_node."""
    run_node("simulator_node", SimulatorNode, PARAMETERS)
