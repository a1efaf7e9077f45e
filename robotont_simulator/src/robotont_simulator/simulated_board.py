"""The firmware's board interface over the simulation; see robotont_firmware.main_loop."""

import math
import time
import types

from robotont_firmware import config
from robotont_firmware.gain_bounds import LARGEST, NO_ARC
from robotont_firmware.main_loop import Controller

EVEN = 0.1  # by which the sines of the angles between wheels may differ
THESIS_MASS, THESIS_INERTIA = 3.576, 0.0429  # [kg, kg m^2] of the robot for which config.LEAD and TURN_LEAD are,
THESIS_DISTANCE, THESIS_WAY = 0.125, 0.035 / 18.75  # [m] of its wheels from its middle; [m/rad] of rim by motor shaft
ROTOR_LEAD = 38  # [1/16 period] of LEAD and TURN_LEAD is the motor's own
HALF = 8         # [1/16 period] by which a LEAD is less than the time constant: a period's effort acts on its mean
DARK = 25  # [periods] that a board without power and then starting does nothing


def configuration(wheels, mass, inertia):
    """The firmware's configuration for `Wheels` and a robot of `mass` [kg] and `inertia` [kg m^2], as attributes."""
    numbers = {name: value for name, value in vars(config).items() if name.isupper()}
    turning = inertia / THESIS_INERTIA * (THESIS_DISTANCE * wheels.amount / sum(wheels.distances)) ** 2
    larger = max(1.0, way(wheels) * 3 / wheels.amount)  # the same force is more torque
    loads = {name: min(round(larger * numbers[name]), config.MAX_TORQUE) for name in ("MAX_LOAD", "BLOCKED_INTEGRAL")}
    leads = {"LEAD": lead(config.LEAD, wheels, mass / THESIS_MASS),
             "TURN_LEAD": lead(config.TURN_LEAD, wheels, turning)}
    return types.SimpleNamespace(**{**numbers, **loads, **leads, "ARC": arc(wheels, leads["LEAD"]),
                                    "RATE": round(wheels.pid_frequency), "PROFILE": "simulated"})


def way(wheels):
    """By how much farther than the thesis' robot a turn of the motor's shaft moves this one."""
    return sum(wheels.radii) / wheels.amount / wheels.gear / THESIS_WAY


def lead(number, wheels, times):
    """LEAD or TURN_LEAD of a robot that is `times` as heavy as the thesis', whose `number` that is.

    A motor feels mass by the square of the way by which it moves it.
    """
    load = times * way(wheels) ** 2 * 3 / wheels.amount
    most = LARGEST // (7 * 256 * config.MAX_SPEED + config.TURN_DRAG)
    return min(round(ROTOR_LEAD + (number - ROTOR_LEAD) * load), most)


def arc(wheels, lead):
    """ARC of the firmware's configuration for wheels one after the other at even angles; of others NO_ARC.

    An arc bends the way of the mass: what of `lead` are the rotors has no part in it.
    """
    after = [*wheels.directions[1:], wheels.directions[0]]
    steps = [math.sin(one - other) for one, other in zip(after, wheels.directions)]
    if max(steps) - min(steps) > EVEN:
        return NO_ARC
    mean = sum(steps) / wheels.amount * sum(wheels.distances) / sum(wheels.metres_per_edge)
    edges = 2 * mean * math.copysign(1, sum(wheels.levers)) * lead / max(1, lead - ROTOR_LEAD + HALF)
    return min(max(round(edges), 2 * config.MAX_SPEED), NO_ARC) if edges > 0 else NO_ARC


LONGEST_STALL = 0.4  # [s] that is made up for; the firmware must not miss half a second of commands at once


class SimulatedBoard:
    """Stand-in for the hardware of the firmware's loop; `run` runs that.

    line: an object with read(size) -> bytes and write(bytes), the board's end of the serial line.
    on_tick(): called once per period, after the physics; returns whether to go on.
    real_time: keep pace with the clock instead of running as fast as possible.
    """

    def __init__(self, simulation, line, on_tick, real_time):
        self.line = line
        self.late = 0  # stalls after which time was skipped
        self._power_failed = False
        self._simulation = simulation
        self._on_tick = on_tick
        self._period = 1.0 / simulation.wheels.pid_frequency
        self.due = time.monotonic() if real_time else None  # [s] when the newest period was over, on its own clock

    def run(self):
        """Run the firmware until the simulation ends, through every failure of the board's supply."""
        cause, wheels = "simulated", self._simulation.wheels
        while True:
            controller = Controller(self, configuration(wheels, *self._simulation.inertia), wheels.amount, cause)
            controller.start()
            controller.run()
            if not self._power_failed:
                return
            for _ in range(DARK):
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
        if self.due is not None:
            self._keep_pace()
        return 1 if self._on_tick() and not self._power_failed else 0

    def _keep_pace(self):
        """Sleep until the period is over.

        The board's periods are even, as those of a hardware timer, however late this program wakes up: after a
        stall it catches up, or, after a long one, skips whole periods.
        """
        self.due += self._period
        ahead = self.due - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -LONGEST_STALL:
            self.late += 1
            self.due += self._period * (-ahead // self._period)

    def counts(self, totals):
        """Fill in the encoders' counters."""
        for wheel, count in enumerate(self._simulation.counts()):
            totals[wheel] = int(count)

    def drive(self, wheel, effort):
        """Put the effort (-FULL_EFFORT..FULL_EFFORT) on a motor."""
        self._simulation.drive(wheel, effort / config.FULL_EFFORT)

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
        for wheel in range(self._simulation.wheels.amount):
            self._simulation.drive(wheel, 0.0)
