"""The simulator's node: the firmware runs on the simulated board in real time; faults come in by topics."""

import threading
from pathlib import Path

import rospy
from geometry_msgs.msg import Vector3
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse

from robotont_boards import BOARDS
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Health
from robotont_driver.ros.lifecycle import run_node
from robotont_driver.ros.worker import read_clocks
from robotont_simulator import company
from robotont_simulator.faulty_port import Port, PortError
from robotont_simulator.official_firmware import OfficialFirmware, make_simulation
from robotont_simulator.sensors import Sensors
from robotont_simulator.simulated_board import SimulatedBoard, configuration
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World, WorldError, read_world
from robotont_simulator.world_map import WorldMap

IMU_RATE = 250.0    # [Hz] readings of gyro and accelerometer
PARAMETERS = (
    Parameter("port", "/tmp/robotont", "name under which the board's serial port appears"),
    Parameter("world", "", "file of walls and boxes; empty: nothing but a floor"),
    company.ROBOTS,
    Parameter("odom_frame", "", "frame whose start on the map is published, with the world's own map; empty: neither"),
    Parameter("seed", 0, "of everything random: encoder offsets, spoilt bytes, errors of the gyro", minimum=0,
              maximum=999999999),
    Parameter("laser_frame", "laser", "frame of the scan"),
    Parameter("scan_rate", 10.0, "scans per second; 0 = off", "Hz", minimum=0.0, maximum=1000.0),
    Parameter("scan_field_of_view", 1.03, "centred on forward; 6.2831853 for all around", "rad", minimum=0.1,
              maximum=6.2831854, reason="a whole turn"),
)


class SimulatorNode:
    """Runs the firmware on the simulated board in real time, in a thread of its own."""

    def __init__(self, _name, wheels, parameters):
        self._parameters = parameters
        # the robot's protocol tells which firmware its board has; any that is not official is this project's
        packets = rospy.get_param("serial_com_node/packets", "")
        self._official = packets if packets in BOARDS else ""
        try:
            world, self._map = self._read_world()
            self._simulation = self._make_simulation(wheels, world)
            self._port = Port(parameters["port"], parameters["seed"])
        except (OSError, ValueError) as error:
            rospy.logfatal("%s", error)
            raise SystemExit(1) from None
        self._lock = threading.Lock()
        self._orders = []  # functions to call between two periods
        self._sensors = Sensors(self._simulation, wheels.pid_frequency, parameters)
        rospy.Service("~unplug", SetBool, self._on_unplug)
        rospy.Subscriber("~byte_errors", Float32, self._on_byte_errors)
        rospy.Subscriber("~push", Vector3, self._on_push)
        rospy.Subscriber("~carry", Vector3, self._on_carry)
        rospy.Subscriber("~visitor", Vector3, self._on_visitor)
        rospy.Subscriber("~battery", Float32, self._on_battery)
        company.watch(self._others, lambda *place: self._order(self._simulation.put_other, *place))
        self._stopping = threading.Event()
        self._late_before = 0
        simulation = self._simulation
        for name, kind, lowest, function in (  # a number per wheel, from the lowest to 1
                ("wheel_grip", Float32MultiArray, 0, simulation.set_grip),  # part of the normal friction
                ("encoders", Int8MultiArray, -1, simulation.set_encoder),
                ("motors", Int8MultiArray, 0, simulation.set_motor),        # 0: gets no current
                ("jam", Int8MultiArray, 0, simulation.set_jam)):            # 1: held fast
            rospy.Subscriber(f"~{name}", kind, self._on_wheels, (name, lowest, function))
        rospy.Service("~brown_out", Trigger, self._on_brown_out)
        self._board = self._make_board()
        self._died = ""  # of what
        self._thread = threading.Thread(target=self._run, daemon=True)
        rospy.on_shutdown(self._stop)
        self._thread.start()
        Health("simulator", {"real time": self._report})
        rospy.loginfo("a board at %s", parameters["port"])

    def _run(self):
        try:
            self._board.run()
        except Exception as error:  # whatever it is: what stands still must not look as if it ran
            self._died = repr(error)
            raise

    def _make_simulation(self, wheels, world):
        if self._official:
            return make_simulation(self._official, wheels, world, self._parameters["seed"], IMU_RATE)
        simulation = Simulation(wheels, world, self._parameters["seed"], IMU_RATE)
        configuration(wheels, *simulation.inertia)  # refuses what the firmware cannot drive
        return simulation

    def _make_board(self):
        """An object with run(); `due`, when the newest period was over, and `late`."""
        if self._official:
            self._port.spoil_commands = False  # one corrupted field can kill the official firmware
            return OfficialFirmware(self._official, self._simulation, self._port, self._on_tick)
        return SimulatedBoard(self._simulation, self._port, self._on_tick, real_time=True)

    def _read_world(self):
        """(World, its WorldMap or None)."""
        file, odom_frame = self._parameters["world"], self._parameters["odom_frame"]
        if file and not Path(file).exists():
            others = ", ".join(sorted(other.stem for other in Path(file).resolve().parent.glob("*.yaml")))
            raise WorldError(f"world: found no file {file}, allowed: {others or 'a file that is there'}")
        world, self._others = company.shared(read_world(file) if file else World((), (0.0, 0.0, 0.0)),
                                             self._parameters["robots"])
        return world, WorldMap(world, odom_frame) if odom_frame else None

    def _on_tick(self):
        """Between two periods: carry out orders, publish; whether to go on."""
        with self._lock:
            orders, self._orders = self._orders, []
        for order in orders:
            order()
        if getattr(self._board, "dead", ""):
            rospy.logerr_throttle(10.0, "the board is dead: %s", self._board.dead)
        self._sensors.publish(self._stamp())
        return not self._stopping.is_set()

    def _stamp(self):
        """When the board's newest period was over, which is a little before now; where time is simulated, now."""
        if not rospy.rostime.is_wallclock():
            return rospy.Time.now()
        steady, now = read_clocks()
        return rospy.Time(nsecs=now - max(0, steady - round(1e9 * self._board.due)))

    def _order(self, function, *arguments):
        with self._lock:
            self._orders.append(lambda: function(*arguments))

    def _on_unplug(self, request):
        self._order(self._port.unplug if request.data else self._plug)
        return SetBoolResponse(success=True, message="unplugged" if request.data else "plugged in")

    def _plug(self):
        try:
            self._port.plug()
        except PortError as error:
            rospy.logerr("not plugged in: %s", error)

    def _on_byte_errors(self, message):
        if in_bounds("byte_errors", message.data, 0.0, 1.0):
            self._port.byte_errors = message.data

    def _on_wheels(self, message, order):
        """Call function(wheel, value) for each wheel, between two periods."""
        name, lowest, function = order
        values = message.data
        if len(values) != self._simulation.wheels.amount:
            rospy.logwarn("~%s: found %d numbers, allowed: %d", name, len(values), self._simulation.wheels.amount)
        elif all(in_bounds(name, value, lowest, 1) for value in values):
            for wheel, value in enumerate(values):
                self._order(function, wheel, value)

    def _on_brown_out(self, _request):
        """Let the board's supply break down for half a second."""
        if self._official:
            return TriggerResponse(success=False, message="not with official firmware")
        self._order(self._board.fail)
        return TriggerResponse(success=True, message="the board restarts in half a second")

    def _on_push(self, message):
        """An impulse: x, y [N s] along the world's axes, z [N m s] around the vertical."""
        if all(in_bounds("push", value, -100.0, 100.0) for value in (message.x, message.y, message.z)):
            self._order(self._simulation.push, message.x, message.y, message.z)

    def _on_carry(self, message):
        """A person puts the robot down at x, y [m], z: its yaw [rad]."""
        if all(in_bounds("carry", value, -1000.0, 1000.0) for value in (message.x, message.y, message.z)):
            self._order(self._simulation.carry, message.x, message.y, message.z)

    def _on_visitor(self, message):
        """Somebody stands at x, y [m]; not a number: leaves."""
        self._order(self._simulation.visit, message.x, message.y)

    def _on_battery(self, message):
        """The battery's voltage [V]."""
        if in_bounds("battery", message.data, 0.0, 17.0):
            self._order(setattr, self._simulation, "voltage", message.data)

    def _report(self):
        late = self._board.late
        new, self._late_before = late - self._late_before, late
        values = {"stalls after which time was skipped": late, "simulated [s]": f"{self._simulation.time:.1f}"}
        if self._died:
            return ERROR, f"the simulation has ended by an error, start it again: {self._died}", values
        if new:
            return WARN, f"{new} stalls after which time was skipped: this machine is too slow, or busy", values
        return OK, "in real time", values

    def _stop(self):
        """End the loop, then the port. Called when ROS begins to shut down."""
        self._stopping.set()
        self._thread.join()
        self._port.unplug()


def in_bounds(name, value, lowest, highest):
    """Whether a number may be used; if not, log why."""
    good = lowest <= value <= highest
    if not good:
        rospy.logwarn("~%s: found %s, allowed: %g to %g", name, value, lowest, highest)
    return good


def main():
    """Run simulator_node."""
    run_node(SimulatorNode)
