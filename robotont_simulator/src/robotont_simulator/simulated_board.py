"""Boards on the simulated robot: with this project's firmware (see robotont_firmware.main_loop), or an official one."""

import itertools
import math
import time
import types

import numpy as np

from robotont_boards import BOARDS, POSITIONS
from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_firmware import config, robot_numbers
from robotont_firmware.main_loop import Controller
from robotont_flash.program import numbers_of
from robotont_simulator.simulation import Simulation

EVEN = 0.1  # by which the sines of the angles between wheels may differ
HOLLOW = 0.34  # moment of inertia of a wheel, in its mass times its radius squared
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
    motor, radius = wheels.motor, sum(wheels.radii) / wheels.amount
    turned = motor.rotor_inertia + HOLLOW * WHEEL_MASS * (radius / wheels.gear) ** 2
    numbers = types.SimpleNamespace(**{
        **{name: value for name, value in vars(config).items() if name.isupper()},
        **numbers_of(wheels._replace(mass=mass)), "PROFILE": "simulated", "EVEN": int(is_even(wheels)),
        "INERTIA": round(1e7 * inertia),
        "TIME_CONSTANT": round(1e3 * turned * motor.no_load_speed / motor.stall_torque)})
    try:
        if wheels.pid_frequency != numbers.RATE:
            raise ValueError(f"config.RATE: found {wheels.pid_frequency:g}, allowed: whole Hz")
        robot_numbers.check(numbers)
    except ValueError as error:
        raise ValueError(f"the firmware cannot drive this robot: {error}. config.EDGES is "
                         "encoderEdgesPerMotorRevolution of the wheel parameters, RATE pidControlFrequency, GEAR "
                         "100 * gearboxReductionRatio, MASS 1000 * robotMass, NO_LOAD_SPEED 10 * motorNoLoadSpeed, "
                         "STALL_TORQUE 1000000 * motorStallTorque") from None
    return numbers


def is_even(wheels):
    """Whether the wheels follow each other at even angles in the direction in which they turn the robot."""
    steps = np.sin(np.diff([*wheels.directions, wheels.directions[0]])) * np.sign(sum(wheels.levers))
    return np.ptp(steps) <= EVEN and steps.sum() > 0


class Pace:
    """Even periods [s], as those of a hardware timer, however late this program wakes up; for a thread.

    A stall is made up for; of one that is longer than `longest` [s] whole periods are skipped.
    """

    def __init__(self, period, longest):
        self._period, self._longest = period, longest
        self.due = time.monotonic()  # [s] when the newest period was over
        self.late = 0  # stalls after which time was skipped

    def wait(self):
        """Sleep until the next period is over."""
        self.due += self._period
        ahead = self.due - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -self._longest:
            self.late += 1
            self.due += self._period * (-ahead // self._period)


class SimulatedBoard:
    """Stand-in for the hardware of the firmware's loop; `run` runs that.

    line: an object with read(size) -> bytes and write(bytes), the board's end of the serial line.
    on_tick(): called once per period, after the physics; returns whether to go on.
    rate: [Hz] of the periods in real time; 0: as fast as possible.
    """

    dead = ""

    def __init__(self, simulation, line, on_tick, rate=0.0):
        self.line, self.pace = line, Pace(1.0 / rate, LONGEST_STALL) if rate else None
        self._power_failed = False
        self._simulation = simulation
        self._on_tick = on_tick

    def run(self):
        """Run the firmware until the simulation ends, through every failure of the board's supply."""
        cause, wheels = "simulated", self._simulation.wheels
        while True:
            controller = Controller(self, configuration(wheels, *self._simulation.inertia), wheels.amount, cause)
            controller.start()
            controller.run()
            if not self._power_failed:
                return
            for _ in range(round(DARK * wheels.pid_frequency)):
                self.wait_tick()
            while self.line.read(4096):
                pass  # lost
            self._power_failed, cause = False, "power"

    def fail(self):
        """Let the board's supply break down at the end of this period."""
        self._power_failed = True

    def wait_tick(self):
        """Let one period pass; 1, or 0 to end."""
        self._simulation.step()
        if self.pace:
            self.pace.wait()
        return 1 if self._on_tick() and not self._power_failed else 0

    def counts(self, totals):
        """Fill in the encoders' counters."""
        for wheel, count in enumerate(self._simulation.counters):
            totals[wheel] = int(count)

    def drive(self, wheel, effort):
        """Put the effort (-FULL_EFFORT..FULL_EFFORT) on a motor."""
        self._simulation.efforts[wheel] = effort / config.FULL_EFFORT

    def fault(self, _wheel):
        """No motor driver, no fault."""
        return False

    def battery(self):
        """[mV] of the battery."""
        return round(self._simulation.voltage * 1000)

    def read(self, buffer):
        """Read the waiting bytes."""
        data = self.line.read(len(buffer))
        buffer[:len(data)] = data
        return len(data)

    def write(self, buffer, size):
        """Send buffer[0:size]."""
        self.line.write(bytes(buffer[:size]))

    def feed(self):
        """No watchdog."""

    def stop(self):
        """All motors off."""
        self._simulation.efforts[:] = 0.0


class SimulatedMotors:
    """The motors and encoders of a `Simulation` for a board of robotont_boards."""

    def __init__(self, simulation):
        self._simulation = simulation
        self._period = 1.0 / simulation.wheels.pid_frequency
        self._before = simulation.counters
        self._owed = 0.0  # [s] that have passed on the board and not in the simulation

    def turn(self, efforts, seconds):
        """Let time pass with efforts from -1 to 1; edges, integers, that the encoders have counted in it."""
        self._simulation.efforts[:] = efforts
        self._owed += seconds
        while self._owed > self._period / 2:
            self._owed -= self._period
            self._simulation.step()
        before, self._before = self._before, self._simulation.counters
        return ((self._before - before + 0x8000) % 0x10000 - 0x8000).tolist()


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
        self.pace = Pace(LOOK, OFFICIAL_STALL)

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
