"""A DC motor with gear and encoder in integers, so that it moves alike on both interpreters.

First order: the speed approaches what the voltage allows with time constant `tau`; Coulomb friction takes
its share and holds the wheel at rest. Speeds in millionths of a unit, one step is 1 ms.
"""

MICRO = 1000000
PERIOD = 20  # [ms]


GOOD, UNPLUGGED, REVERSED, HALF = "good", "unplugged", "reversed", "half"  # HALF: one channel is dead


class SimMotor:
    """tau: [ms]. friction: [units] of speed that it costs. battery: [%] of 12 V.

    blocked: nothing turns it. powered: current reaches it. encoder: GOOD, UNPLUGGED, REVERSED or HALF.
    """

    def __init__(self, tau=60, friction=8, battery=100, full_effort=4000, no_load=208):
        self.tau = tau
        self.friction = friction * MICRO
        self.per_effort = no_load * MICRO * battery // 100 // full_effort
        self.full_effort = full_effort
        self.blocked = False
        self.powered = True
        self.encoder = GOOD
        self.effort = 0
        self.speed = 0
        self.position = 0  # [millionths of an edge]
        self.counted = 0  # [millionths of an edge] what of that reaches the board

    def total(self):
        """Return the encoder's total [edges] as the board counts it."""
        return self.counted // MICRO

    def current(self):
        """Return the motor's current in [effort], whose 4000 are 5 A."""
        return self.effort - self.speed * self.full_effort // (208 * MICRO) if self.powered else 0

    def drive(self, effort):
        """Set the voltage; more than the battery has is cut off."""
        self.effort = max(-self.full_effort, min(self.full_effort, effort))

    def run(self, milliseconds):
        """Let time pass."""
        for _ in range(milliseconds):
            self._millisecond()

    def _millisecond(self):
        if self.blocked:
            self.speed = 0
            return
        pull = self.per_effort * self.effort - self.speed if self.powered else -self.speed // 8
        if self.speed == 0:
            if abs(pull) <= self.friction:
                return
            direction = 1 if pull > 0 else -1
        else:
            direction = 1 if self.speed > 0 else -1
        speed = self.speed + (pull - direction * self.friction) // self.tau
        # Friction stops a wheel but never turns it round.
        self.speed = 0 if speed * direction < 0 else speed
        self.position += self.speed // PERIOD
        if self.encoder == REVERSED:
            self.counted -= self.speed // PERIOD
        elif self.encoder == HALF:  # there and back again, one edge
            self.counted = self.counted // (2 * MICRO) * (2 * MICRO) + self.position // MICRO % 2 * MICRO
        elif self.encoder != UNPLUGGED:
            self.counted += self.speed // PERIOD


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
            totals[index] = self.motors[index].total() & 0xFFFF

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
