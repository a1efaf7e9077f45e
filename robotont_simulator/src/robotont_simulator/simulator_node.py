"""The simulator's node: the firmware runs on the simulated board in real time; faults come in by topics."""

import threading
from pathlib import Path

import rospy
from geometry_msgs.msg import Vector3
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse

from robotont_boards import BOARDS
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.clocks import read_clocks
from robotont_driver.ros.diagnostics import OK, WARN, Health
from robotont_driver.ros.lifecycle import run_node
from robotont_simulator.faulty_port import Port, PortError
from robotont_simulator.official_firmware import OfficialFirmware, make_simulation
from robotont_simulator.sensors import Sensors
from robotont_simulator.simulated_board import SimulatedBoard, SimulatedFirmware
from robotont_simulator.simulation import GOOD, REVERSED, UNPLUGGED, Simulation
from robotont_simulator.world import World, WorldError, read_world
from robotont_simulator.world_map import WorldMap

IMU_RATE = 250.0    # [Hz] readings of gyro and accelerometer
PARAMETERS = (
    Parameter("port", "/tmp/robotont", "name under which the board's serial port appears"),
    Parameter("world", "", "file of walls and boxes; empty: nothing but a floor"),
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

    def __init__(self, wheels, parameters):
        self._parameters = parameters
        # the robot's dialect tells which firmware its board has; any that is not official is this project's
        packets = rospy.get_param("serial_com_node/packets", "")
        self._official = packets if packets in BOARDS else ""
        world, self._map = self._read_world()
        self._simulation = self._make_simulation(wheels, world)
        self._port = self._make_port()
        self._lock = threading.Lock()
        self._orders = []  # functions to call between two periods
        self._sensors = Sensors(self._simulation, wheels.pid_frequency, parameters)
        rospy.Service("~unplug", SetBool, self._on_unplug)
        rospy.Subscriber("~byte_errors", Float32, self._on_byte_errors)
        rospy.Subscriber("~push", Vector3, self._on_push)
        rospy.Subscriber("~carry", Vector3, self._on_carry)
        rospy.Subscriber("~visitor", Vector3, self._on_visitor)
        rospy.Subscriber("~battery", Float32, self._on_battery)
        self._stopping = threading.Event()
        self._late_before = 0
        simulation, states = self._simulation, {1: GOOD, 0: UNPLUGGED, -1: REVERSED}
        for name, kind, lowest, function in (  # a number per wheel, from the lowest to 1
                ("wheel_grip", Float32MultiArray, 0, simulation.set_grip),  # part of the normal friction
                ("encoders", Int8MultiArray, -1, lambda wheel, value: simulation.set_encoder(wheel, states[value])),
                ("motors", Int8MultiArray, 0, simulation.set_motor),        # 0: gets no current
                ("jam", Int8MultiArray, 0, simulation.set_jam)):            # 1: held fast
            rospy.Subscriber(f"~{name}", kind, self._on_wheels, (name, lowest, function))
        rospy.Service("~brown_out", Trigger, self._on_brown_out)
        self._firmware = self._make_firmware(wheels)
        self._thread = threading.Thread(target=self._run, daemon=True)
        rospy.on_shutdown(self._stop)
        self._thread.start()
        Health("simulator", {"real time": self._report})
        rospy.loginfo("a board at %s", parameters["port"])

    def _make_port(self):
        try:
            return Port(self._parameters["port"], self._parameters["seed"])
        except PortError as error:
            rospy.logfatal("~port: %s", error)
            raise SystemExit(1) from None

    def _make_simulation(self, wheels, world):
        given = self._parameters
        if not self._official:
            return Simulation(wheels, world, given["seed"], IMU_RATE)
        try:
            return make_simulation(self._official, wheels, world, given["seed"], IMU_RATE)
        except ValueError as error:
            rospy.logfatal("firmware of %s: %s", self._official, error)
            raise SystemExit(1) from None

    def _make_firmware(self, wheels):
        """An object with start() and run(); `_board` has `due`, when the newest period was over, and `late`."""
        if self._official:
            self._port.spoil_commands = False  # one corrupted field can kill the official firmware
            self._board = OfficialFirmware(self._official, self._simulation, self._port, self._on_tick)
            return self._board
        self._board = SimulatedBoard(self._simulation, self._port, self._on_tick, real_time=True)
        return SimulatedFirmware(self._board)

    def _read_world(self):
        """(World, its WorldMap or None)."""
        given = self._parameters
        try:
            world = read_world(given["world"]) if given["world"] else World((), (0.0, 0.0, 0.0))
            return world, WorldMap(world, given["odom_frame"]) if given["odom_frame"] else None
        except FileNotFoundError:
            others = ", ".join(sorted(file.stem for file in Path(given["world"]).resolve().parent.glob("*.yaml")))
            rospy.logfatal("world: found no file %s, allowed: %s", given["world"], others or "a file that is there")
        except (OSError, WorldError) as error:
            rospy.logfatal("world: %s", error)
        raise SystemExit(1)

    def _run(self):
        self._firmware.start()
        self._firmware.run()

    def _on_tick(self):
        """Between two periods: carry out orders, publish; whether to go on."""
        with self._lock:
            orders, self._orders = self._orders, []
        for order in orders:
            order()
        if getattr(self._firmware, "dead", ""):
            rospy.logerr_throttle(10.0, "the board is dead: %s", self._firmware.dead)
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
        if check("byte_errors", message.data, 0.0, 1.0):
            self._port.byte_errors = message.data

    def _on_wheels(self, message, order):
        """Call function(wheel, value) for each wheel, between two periods."""
        name, lowest, function = order
        values = message.data
        if len(values) != self._simulation.wheels.amount:
            rospy.logwarn("~%s: found %d numbers, allowed: %d", name, len(values), self._simulation.wheels.amount)
        elif all(check(name, value, lowest, 1) for value in values):
            for wheel, value in enumerate(values):
                self._order(function, wheel, value)

    def _on_brown_out(self, _request):
        """Let the board's supply break down for half a second."""
        if not isinstance(self._firmware, SimulatedFirmware):
            return TriggerResponse(success=False, message="not with official firmware")
        self._order(self._firmware.fail)
        return TriggerResponse(success=True, message="the board restarts in half a second")

    def _on_push(self, message):
        """An impulse: x, y [N s] along the world's axes, z [N m s] around the vertical."""
        if all(check("push", value, -100.0, 100.0) for value in (message.x, message.y, message.z)):
            self._order(self._simulation.push, message.x, message.y, message.z)

    def _on_carry(self, message):
        """A person puts the robot down at x, y [m], z: its yaw [rad]."""
        if all(check("carry", value, -1000.0, 1000.0) for value in (message.x, message.y, message.z)):
            self._order(self._simulation.carry, message.x, message.y, message.z)

    def _on_visitor(self, message):
        """Somebody stands at x, y [m]; not a number: leaves."""
        self._order(self._simulation.visit, message.x, message.y)

    def _on_battery(self, message):
        """The battery's voltage [V]."""
        if check("battery", message.data, 0.0, 17.0):
            self._order(setattr, self._simulation, "voltage", message.data)

    def _report(self):
        late = self._board.late
        new, self._late_before = late - self._late_before, late
        values = {"stalls after which time was skipped": late, "simulated [s]": f"{self._simulation.time:.1f}"}
        if new:
            return WARN, f"{new} stalls after which time was skipped: this machine is too slow, or busy", values
        return OK, "in real time", values

    def _stop(self):
        """End the loop, then the port. Called when ROS begins to shut down."""
        self._stopping.set()
        self._thread.join()
        self._port.unplug()


def check(name, value, lowest, highest):
    """Whether a number may be used; if not, log why."""
    good = lowest <= value <= highest
    if not good:
        rospy.logwarn("~%s: found %s, allowed: %g to %g", name, value, lowest, highest)
    return good


def main():
    """Run simulator_node."""
    run_node("simulator_node", SimulatorNode, PARAMETERS)
