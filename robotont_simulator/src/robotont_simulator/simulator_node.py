"""The simulator's node: the firmware runs on the simulated board in real time; faults come in by topics."""

import functools
import math
import threading
import time
from collections import deque

import numpy as np
import rospy
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, LaserScan
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse

from robotont_boards import BOARDS
from robotont_driver.nodes.odom_node import read_clocks
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health
from robotont_driver.ros.lifecycle import run_node
from robotont_simulator import simulated_board as boards
from robotont_simulator.faulty_port import Port
from robotont_simulator.simulation import Simulation
from robotont_simulator.surroundings import ROBOTS, WorldMap, fill, watch, watch_visitor, world_of

SCAN_RAYS = 128     # measurements per scan
SCAN_NEAREST, SCAN_FARTHEST = 0.3, 4.0  # [m] nearer things read -inf (REP 117), farther ones are not seen
IMU_BURST = 500  # readings that may wait: more than a stall makes up for
IMU_RATE = 250.0    # [Hz] readings of gyro and accelerometer
PARAMETERS = (
    Parameter("port", "/tmp/robotont", "name under which the board's serial port appears"),
    Parameter("world", "", "file of the world; empty: nothing but a floor"),
    ROBOTS,
    Parameter("odom_frame", "", "frame whose start on the map is published, with the world's own map; empty: neither"),
    Parameter("seed", 0, "of encoder offsets, spoilt bytes, errors of the gyro", minimum=0, maximum=999999999),
    Parameter("laser_frame", "laser", "frame of the scan"),
    Parameter("scan_rate", 10.0, "scans per second, about; one a packet at most; 0 = off", "Hz", minimum=0.0,
              maximum=1000.0),
    Parameter("scan_field_of_view", 1.03, "centred on forward; 6.2831853 for all around", "rad", minimum=0.1,
              maximum=6.2831854, reason="a whole turn"),
)


class Sensors:
    """Publishes ground truth, a scan and an IMU's readings, each period of `frequency` [Hz]; parameters: the node's."""

    def __init__(self, simulation, frequency, parameters):
        self._simulation, self._ticks = simulation, 0
        field, rate = parameters["scan_field_of_view"], parameters["scan_rate"]
        self._scan_ticks = max(1, round(frequency / rate)) if rate else math.inf
        self._angles = np.linspace(-field / 2, field / 2, SCAN_RAYS, endpoint=field < 2 * math.pi - 1e-6)
        base = rospy.get_param("odom_node/base_frame", "base_link")
        self._truth, self._imu = Odometry(child_frame_id=base), Imu()
        self._scan = LaserScan(
            angle_min=self._angles[0], angle_max=self._angles[-1], angle_increment=self._angles[1] - self._angles[0],
            range_min=SCAN_NEAREST, range_max=SCAN_FARTHEST, scan_time=1.0 / rate if rate else 0.0)
        self._imu.orientation_covariance[0] = -1.0  # it reports none
        self._imu.angular_velocity_covariance, self._imu.linear_acceleration_covariance = (
            np.diag(part ** 2).ravel().tolist() for part in np.split(simulation.imu_errors.deviation, 2))
        self._publishers = {}
        for message, topic, waiting, frame in (
                (self._truth, "ground_truth/odom", 10, "map"), (self._imu, "imu", IMU_BURST, base),
                (self._scan, "scan", 2, parameters["laser_frame"]))[:3 if rate else 2]:
            message.header.frame_id = frame
            self._publishers[type(message)] = rospy.Publisher(topic, type(message), queue_size=waiting)

    def publish(self, stamp):
        """What there is now, or at the period's end [rospy.Time]."""
        self._ticks += 1
        truth, twist = self._truth, self._truth.twist.twist
        fill(truth.pose.pose.position, truth.pose.pose.orientation, self._simulation.pose())
        twist.linear.x, twist.linear.y, twist.angular.z = self._simulation.twist()
        self._send(truth, stamp)
        readings = self._simulation.imu_readings
        rate, acceleration = self._imu.angular_velocity, self._imu.linear_acceleration
        for later, reading in zip(range(len(readings) - 1, -1, -1), readings):  # each with its own stamp
            rate.x, rate.y, rate.z, acceleration.x, acceleration.y, acceleration.z = reading.tolist()
            self._send(self._imu, stamp - rospy.Duration.from_sec(later * self._simulation.imu_interval))
        if self._ticks % self._scan_ticks == 0:
            self._scan.ranges = self._simulation.scan(self._angles, SCAN_NEAREST, SCAN_FARTHEST).tolist()
            self._send(self._scan, stamp)

    def _send(self, message, stamp):
        message.header.stamp = stamp
        self._publishers[type(message)].publish(message)


class SimulatorNode:
    """Runs the firmware on the simulated board in real time, in a thread of its own."""

    def __init__(self, _name, wheels, parameters):
        # the robot's protocol tells which firmware its board has; any that is not official is this project's
        packets = rospy.get_param("serial_com_node/packets", "")
        world = world_of(parameters)
        about = wheels, world, parameters["seed"], IMU_RATE
        # one corrupted field can kill the official firmware
        self._port = port = Port(parameters["port"], parameters["seed"], packets not in BOARDS)
        try:
            self._map = WorldMap(world, parameters["odom_frame"]) if parameters["odom_frame"] else None
            self._board = board = boards.SimulatedBoard(Simulation(*about), port) if packets not in BOARDS else \
                boards.OfficialFirmware(packets, boards.make_simulation(packets, *about), port)
            port.plug()
        except (OSError, ValueError) as error:
            rospy.logfatal("%s", error)
            raise SystemExit(1) from None
        self._simulation = simulation = board.simulation
        self._orders = deque()  # functions to call between two periods
        self._sensors = Sensors(simulation, wheels.pid_frequency, parameters)
        for name, kind, lowest, highest, function in (
                ("byte_errors", Float32, 0, 1, functools.partial(setattr, port, "byte_errors")),
                ("battery", Float32, 0, 17, functools.partial(setattr, simulation, "voltage")),  # [V]
                ("push", Vector3, -100, 100, simulation.push),      # x, y [N s] along the world's axes, z [N m s]
                ("carry", Vector3, -1000, 1000, simulation.carry),  # x, y [m], z: its yaw [rad]
                # a number per wheel
                ("wheel_grip", Float32MultiArray, 0, 1, simulation.set_grip),  # part of the normal friction
                ("encoders", Int8MultiArray, -1, 1, functools.partial(np.copyto, simulation.encoders)),
                ("motors", Int8MultiArray, 0, 1, functools.partial(np.copyto, simulation.powered)),  # 0: no current
                ("jam", Int8MultiArray, 0, 1, simulation.set_jam)):            # 1: held fast
            rospy.Subscriber(f"~{name}", kind, self._on_fault, (name, lowest, highest, function))
        watch_visitor(functools.partial(self._order, simulation.put))
        watch(world.others, functools.partial(self._order, simulation.put))
        rospy.Service("~unplug", SetBool, self._on_unplug)
        rospy.Service("~brown_out", Trigger, self._on_brown_out)
        self._late, self._late_before, self._died = 0, 0, ""  # stalls after which time was skipped; why it has ended
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        rospy.on_shutdown(self._stop)
        Health("simulator", {"real time": self._report})
        self._due = time.monotonic()  # [s] when the newest period was over
        self._thread.start()  # last: who hears of it may end this node at once
        rospy.loginfo("a board at %s", parameters["port"])

    def _run(self):
        try:
            while not self._stopping.is_set():
                self._advance()
        except Exception as error:  # whatever it is: what stands still must not look as if it ran
            self._died = repr(error)
            raise

    def _advance(self):
        """Carry out orders, let the board's time pass, and publish."""
        while self._orders:
            try:
                self._orders.popleft()()
            except ValueError as error:  # of a port that cannot be plugged in
                rospy.logerr("not done: %s", error)
        self._board.advance(self._wait)
        # when the newest period was over, which is a little before now; where time is simulated, now
        steady, now = read_clocks()
        late = steady - round(1e9 * self._due) if rospy.rostime.is_wallclock() else 0
        self._sensors.publish(rospy.Time(nsecs=now - max(0, late)))
        if self._board.dead:
            rospy.logerr_throttle(10.0, "the board is dead: %s", self._board.dead)

    def _wait(self):
        """Sleep until the board's next period is over, which are even as those of a hardware timer.

        A stall is made up for; of one that is longer than `board.longest` [s] whole periods are skipped.
        """
        self._due += self._board.period
        ahead = self._due - time.monotonic()
        time.sleep(max(0.0, ahead))
        if ahead < -self._board.longest:
            self._late += 1
            self._due += self._board.period * (-ahead // self._board.period)

    def _order(self, function, *arguments):
        self._orders.append(functools.partial(function, *arguments))

    def _on_unplug(self, request):
        self._order(self._port.unplug if request.data else self._port.plug)
        return SetBoolResponse(success=True, message="unplugged" if request.data else "plugged in")

    def _on_fault(self, message, order):
        """Call the function with the message's numbers between two periods, if they are in bounds."""
        name, lowest, highest, function = order
        numbers = (message.x, message.y, message.z) if isinstance(message, Vector3) else message.data
        values, array = np.atleast_1d(numbers).tolist(), hasattr(message, "layout")
        wanted = self._simulation.wheels.amount if array else len(values)
        if len(values) == wanted and all(lowest <= value <= highest for value in values):
            self._order(function, *[values] if array else values)
        else:
            rospy.logwarn("~%s: found %s, allowed: %d numbers, %g to %g", name, values[:20], wanted, lowest, highest)

    def _on_brown_out(self, _request):
        if isinstance(self._board, boards.OfficialFirmware):
            return TriggerResponse(success=False, message="not with official firmware")
        self._order(self._board.fail)
        return TriggerResponse(success=True, message="the board restarts in half a second")

    def _report(self):
        new, self._late_before = self._late - self._late_before, self._late
        values = {"stalls after which time was skipped": self._late, "simulated [s]": f"{self._simulation.time:.1f}"}
        if self._died:
            return ERROR, f"the simulation has ended by an error, start it again: {self._died}", values
        if new:
            return WARN, f"time was skipped {new} times: this machine is too slow, or busy", values
        return OK, "no time was skipped", values

    def _stop(self):
        """End the loop, then the port. Called when ROS begins to shut down."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self._port.unplug()


def main():
    """Run simulator_node."""
    run_node(SimulatorNode)
