"""Robotont's boards with the official firmware on the simulated robot, instead of this project's own."""

import itertools
import math

from robotont_boards import BOARDS, POSITIONS
from robotont_simulator.simulated_board import Pace
from robotont_simulator.simulation import Simulation

MOTORS_FREQUENCY = 100  # [Hz] the physics moves on in periods of the fastest control, 10 ms
LOOK, LOOKS = 0.005, 4  # [s] between two looks at the serial port, and how many to a tick
LONGEST_STALL = 0.1     # [s] of time that is made up for; what the computer loses beyond that is given up
LARGEST_ANGLE = 0.1     # [rad] by which a wheel may be elsewhere than the board believes


class SimulatedMotors:
    """The motors and encoders of a `Simulation` for a board of robotont_boards."""

    def __init__(self, simulation):
        self._simulation = simulation
        self._period = 1.0 / simulation.wheels.pid_frequency
        self._before = simulation.counts()
        self._owed = 0.0  # [s] that have passed on the board and not in the simulation

    def turn(self, efforts, seconds):
        """Let time pass with efforts from -1 to 1; edges, integers, that the encoders have counted in it."""
        for motor, effort in enumerate(efforts):
            self._simulation.drive(motor, effort)
        self._owed += seconds
        while self._owed > self._period / 2:
            self._owed -= self._period
            self._simulation.step()
        counts = self._simulation.counts()
        turned = (counts - self._before + 0x8000) % 0x10000 - 0x8000
        self._before = counts
        return [int(edges) for edges in turned]


def make_simulation(name, wheels, world, seed, imu_rate=0.0):
    """`Simulation` for a board with an official firmware. Raises ValueError for wheels that it cannot have."""
    places = [math.remainder(found - wanted, 2 * math.pi) for found, wanted in zip(wheels.positions, POSITIONS)]
    placed = min(wheels.levers) > 0 and max(map(abs, places)) <= LARGEST_ANGLE
    if wheels.amount != 3 or not placed:
        raise ValueError(f"found another robot's wheels, allowed: those of robot:={name}, or calibrated ones")
    return Simulation(wheels._replace(pid_frequency=MOTORS_FREQUENCY), world, seed, imu_rate)


class OfficialFirmware:
    """Runs a board of robotont_boards in real time: `line` has read(size) and write(bytes), the board's end.

    on_tick(): called every 20 ms; returns whether to go on.
    """

    def __init__(self, name, simulation, line, on_tick):
        self._board = BOARDS[name](SimulatedMotors(simulation))
        self._line = line
        self._on_tick = on_tick
        self.pace = Pace(LOOK, LONGEST_STALL)

    @property
    def dead(self):
        """Cause of the board's halt; empty while it runs."""
        return self._board.dead

    def run(self):
        """Serve until `on_tick` returns false."""
        board = self._board
        for look in itertools.count(1):
            self.pace.wait()
            for line in self._line.read(4096).splitlines(keepends=True):
                board.receive(line, board.now)
            data = board.advance(board.now + LOOK)
            if data:
                self._line.write(data)
            if look % LOOKS == 0 and not self._on_tick():
                return
