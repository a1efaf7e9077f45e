"""Boards on the simulated robot: with this project's firmware (see robotont_firmware.main_loop), or an official one."""

import math
import types

from robotont_boards import BOARDS, POSITIONS
from robotont_firmware import config, robot_numbers
from robotont_firmware.main_loop import Controller
from robotont_flash.program import numbers_of
from robotont_simulator.simulation import Simulation

DARK = 0.5  # [s] that a board without power and then starting does nothing
MOTORS_FREQUENCY = 100  # [Hz] the physics moves on in periods of the fastest official control, 10 ms
LOOK, LOOKS = 0.005, 4  # [s] between two looks of an official board at its serial port, and how many to a tick
OFFICIAL_STALL = 0.1    # [s] of time that is made up for; what the computer loses beyond that is given up
LARGEST_ANGLE = 0.1     # [rad] by which a wheel may be elsewhere than an official board believes
LONGEST_STALL = 0.4  # [s] that is made up for; the firmware must not miss half a second of commands at once


def configuration(wheels, mass, inertia):
    """The firmware's configuration, attributes, for `Wheels` and a robot of `mass` [kg] and `inertia` [kg m^2].

    Raises ValueError, with what was found and what is allowed, for a robot that the firmware cannot drive.
    """
    rate = wheels.pid_frequency
    numbers = types.SimpleNamespace(**{
        **vars(config), **numbers_of(wheels._replace(mass=mass)), "PROFILE": "simulated",
        "INERTIA": round(1e7 * inertia), "RATE": rate if rate % 1 else int(rate)})
    try:
        robot_numbers.check(numbers)
    except ValueError as error:
        raise ValueError(f"the firmware cannot drive this robot: {error}. config.EDGES is "
                         "encoderEdgesPerMotorRevolution of the wheel parameters, RATE pidControlFrequency, GEAR "
                         "100 * gearboxReductionRatio, MASS 1000 * robotMass, NO_LOAD_SPEED 10 * motorNoLoadSpeed, "
                         "STALL_TORQUE 1000000 * motorStallTorque") from None
    return numbers


class SimulatedBoard:
    """The firmware of this project on a `Simulation`; the rest is what its loop needs of a board.

    line: an object with read(size) -> bytes and write(bytes), the board's end of the serial line. wheels: what the
    firmware is told, the true ones where None. Raises ValueError for a robot that it cannot drive.
    """

    dead, longest = "", LONGEST_STALL

    def __init__(self, simulation, line, wheels=None):
        self.simulation, self.line = simulation, line
        self._wheels = wheels or simulation.wheels
        self._numbers = configuration(self._wheels, *simulation.inertia)
        self.period = 1.0 / self._wheels.pid_frequency  # [s]
        self._controller, self._cause, self._dark = None, "simulated", 0  # dark: [periods] that it will do nothing

    def advance(self, wait):
        """Let a period pass, `wait()` until it is over, and send its packet."""
        if not self._controller and not self._dark:
            self._controller = Controller(self, self._numbers, self._cause)
            self._controller.start()
        self.simulation.step()
        wait()
        if self._controller:
            self._controller.step(1)
        else:
            self._dark -= 1
            self.line.read(4096)  # lost

    def fail(self):
        """Let the board's supply break down for half a second."""
        self.simulation.efforts[:] = 0.0
        self._controller, self._cause, self._dark = None, "power", round(DARK / self.period)

    def counts(self, totals):
        """Fill in the encoders' counters."""
        for wheel, count in enumerate(self.simulation.counters):
            totals[wheel] = int(count)

    def drive(self, wheel, effort):
        """Put the effort (-FULL_EFFORT..FULL_EFFORT) on a motor."""
        self.simulation.efforts[wheel] = effort / robot_numbers.FULL_EFFORT

    def fault(self, _wheel):
        """No motor driver, no fault."""
        return False

    def battery(self):
        """[mV] of the battery."""
        return round(self.simulation.voltage * 1000)

    def read(self, buffer):
        """Read the waiting bytes."""
        data = self.line.read(len(buffer))
        buffer[:len(data)] = data
        return len(data)

    def write(self, buffer, size):
        """Send buffer[0:size]."""
        self.line.write(bytes(buffer[:size]))


def make_simulation(name, wheels, world, seed, imu_rate=0.0):
    """`Simulation` for a board with an official firmware. Raises ValueError for wheels that it cannot have."""
    places = [math.remainder(found - wanted, 2 * math.pi) for found, wanted in zip(wheels.positions, POSITIONS)]
    if wheels.amount != 3 or min(wheels.levers) <= 0 or max(map(abs, places)) > LARGEST_ANGLE:
        raise ValueError(f"found another robot's wheels, allowed: those of robot:={name}, or calibrated ones")
    return Simulation(wheels._replace(pid_frequency=MOTORS_FREQUENCY), world, seed, imu_rate)


class OfficialFirmware:
    """A board of robotont_boards on a `Simulation` of `make_simulation`; line: as of `SimulatedBoard`."""

    period, longest, dead = LOOK, OFFICIAL_STALL, ""  # dead: cause of the board's halt

    def __init__(self, name, simulation, line):
        self.simulation, self.line, self._board = simulation, line, BOARDS[name](simulation)

    def advance(self, wait):
        """Let 20 ms pass; `wait()` for each look at the line in them."""
        board = self._board
        for _ in range(LOOKS):
            wait()
            for line in self.line.read(4096).splitlines(keepends=True):
                board.receive(line, board.now)
            self.line.write(board.advance(board.now + LOOK))
        self.dead = board.dead
