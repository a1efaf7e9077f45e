"""A DC motor with gear and encoder in integers, so that it moves alike on all interpreters.

First order: the speed approaches what the voltage allows with time constant `tau`; Coulomb friction takes
its share and holds the wheel at rest. Speeds in millionths of a unit, one step is 1 ms. Every number stays
below 2^30 in magnitude, and the steps are compiled to machine code, so that the emulated board keeps up.
"""

from robotont_firmware.compat import const, micropython

MICRO = const(1000000)
PERIOD = const(20)  # [ms]

GOOD = const(0)  # encoders
UNPLUGGED = const(1)
REVERSED = const(2)
HALF = const(3)  # one channel is dead


class SimMotor:
    """tau: [ms]. friction: [units] of speed that it costs. battery: [%] of 12 V.

    blocked: nothing turns it. powered: current reaches it. encoder: GOOD, UNPLUGGED, REVERSED or HALF.
    """

    def __init__(self, tau=60, friction=8, battery=100, full_effort=4000, no_load=208):
        self.tau = tau
        self.friction = friction * MICRO
        self.per_effort = no_load * MICRO // full_effort * battery // 100
        self.full_effort = full_effort
        self.blocked = False
        self.powered = True
        self.encoder = GOOD
        self.effort = 0
        self.speed = 0
        self.turned = 0  # [edges] that the wheel turned
        self.counted = 0  # [edges] of those that reach the board
        self._turned_part = self._counted_part = 0  # [millionths of an edge] 0..999999, on top of them

    def current(self):
        """Return the motor's current in [effort], whose 4000 are 5 A."""
        return self.effort - self.speed // (208 * MICRO // self.full_effort) if self.powered else 0

    def drive(self, effort):
        """Set the voltage; more than the battery has is cut off."""
        self.effort = max(-self.full_effort, min(self.full_effort, effort))

    @micropython.viper
    def run(self, milliseconds: int):
        """Let time pass."""
        speed = int(self.speed)
        turned, turned_part = int(self.turned), int(self._turned_part)
        counted, counted_part = int(self.counted), int(self._counted_part)
        tau, friction = int(self.tau), int(self.friction)
        drive = int(self.per_effort) * int(self.effort)
        powered, encoder = int(self.powered), int(self.encoder)
        if self.blocked:
            speed = milliseconds = 0
        for _ in range(milliseconds):
            pull = drive - speed if powered else (0 - speed) // 8
            if speed == 0 and pull <= friction and pull >= 0 - friction:
                break
            direction = 1 if speed > 0 or (speed == 0 and pull > 0) else -1
            speed += (pull - direction * friction) // tau
            if speed * direction < 0:  # friction stops a wheel but never turns it round
                speed = 0
            step = speed // PERIOD
            turned_part += step
            turned += turned_part // MICRO
            turned_part -= turned_part // MICRO * MICRO
            if encoder == HALF:  # there and back again, one edge
                counted = counted // 2 * 2 + (turned & 1)
            elif encoder != UNPLUGGED:
                counted_part += 0 - step if encoder == REVERSED else step
                counted += counted_part // MICRO
                counted_part -= counted_part // MICRO * MICRO
        self.speed = speed
        self.turned, self._turned_part = turned, turned_part
        self.counted, self._counted_part = counted, counted_part


class SimBoard:
    """The board interface of robotont_firmware.controller over simulated motors; time is the ticks.

    latency: [ms] from the tick until the new effort acts, which the board spends reading and calculating.
    sent: every byte that was written. faults: set faults[wheel] to raise a motor driver's fault.
    """

    def __init__(self, motors, latency=3, keep=True):
        self.motors = motors
        self.latency = latency
        self.inbox = b""
        self.sent = b""
        self.keep = keep
        self.faults = [False] * len(motors)
        self.stopped = False
        self.fed = 0
        self.ticks_left = 1 << 30
        self.skip = 1
        self._next = [0] * len(motors)

    def wait_tick(self):
        if self.ticks_left == 0:
            return 0
        self.ticks_left -= 1
        periods = self.skip
        self.skip = 1
        for index in range(len(self.motors)):
            motor = self.motors[index]
            for _ in range(periods):
                motor.run(self.latency)
                motor.drive(self._next[index])
                motor.run(PERIOD - self.latency)
        return periods

    def counts(self, totals):
        for index in range(len(self.motors)):
            totals[index] = self.motors[index].counted & 0xFFFF

    def drive(self, wheel, effort):
        self._next[wheel] = effort

    def fault(self, wheel):
        return self.faults[wheel]

    def read(self, buffer):
        size = min(len(buffer), len(self.inbox))
        for at in range(size):
            buffer[at] = self.inbox[at]
        if size:
            self.inbox = self.inbox[size:]
        return size

    def write(self, buffer, size):
        if self.keep:
            self.sent += bytes(buffer[:size])

    def feed(self):
        self.fed += 1

    def stop(self):
        self.stopped = True
        for wheel in range(len(self.motors)):
            self._next[wheel] = 0
