"""A PC and a board in one process, as fast as the machine allows: for tests, benchmarks and python3 -i."""

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.checked import Checked, add_checksum
from robotont_driver.protocol.protocol import format_packet
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.simulated_board import SimulatedBoard
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World


def robot(name="", seed=0):
    """A `LockstepRun` of a robot (docs/robots.md) on an empty floor. Raises OSError or ValueError without one."""
    return LockstepRun(Simulation(read_robot(name).wheels, World(), seed))


class LockstepRun:
    """Drives a `Simulation` by twists, through the packets and the firmware, and keeps odometry.

    counts: the list of all packets' counts. path: (time [s], odometry pose, true pose) of each packet.
    believed: `Wheels` that commands, odometry and the firmware are told; None: the true ones.
    """

    def __init__(self, simulation, believed=None):
        wheels = believed or simulation.wheels
        self.simulation, self.kinematics = simulation, Kinematics(wheels)
        self.odometry = WheelOdometry(self.kinematics, 1.0 / wheels.pid_frequency, 0.01)
        self.counts, self.path = [], []
        self._to_board, self._reader = bytearray(), Checked(wheels)
        self._board = SimulatedBoard(simulation, self, wheels)

    @property
    def status(self):
        """The newest BoardStatus."""
        return self._reader.health.status

    def drive(self, twists):
        """Command one twist per period, until the iterable ends; None commands nothing."""
        for twist in twists:
            if twist is not None:
                self._to_board += add_checksum(format_packet(self.kinematics.units_of_twist(twist), 2))
            self._board.advance(lambda: None)

    def hold(self, twist, seconds):
        """Command one twist for a time; the newest pose of the odometry and of the truth."""
        self.drive([twist] * round(seconds * self.simulation.wheels.pid_frequency))
        return self.path[-1][1:]

    def read(self, size):
        """The board reads."""
        data, self._to_board = self._to_board[:size], self._to_board[size:]
        return bytes(data)

    def write(self, data):
        """The board writes."""
        for counts in self._reader.feed(data, self.simulation.time):
            self.counts.append(counts)
            self.odometry.update(counts, 0.0)
            pose = self.odometry.pose
            self.path.append((self.simulation.time, (pose.x, pose.y, pose.yaw), self.simulation.pose()))
