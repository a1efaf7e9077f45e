"""A DC motor with driver, gear and encoder in integers, so that it moves alike on all interpreters.

Mechanics of first order: the speed approaches what the torque allows with time constant `tau` (it grows with the
mass that the motor moves); Coulomb friction takes its share and holds the wheel at rest, `load` (a slope) pulls
backward. The torque is the mean current of a pulse period, by the driver's kind: see `SimMotor`. All are in units of
speed: a torque of 20 units is what the back-EMF at 20 units would give in a shorted motor.

Speeds in millionths of a unit, one step is 1 ms. Every number stays below 2^30 in magnitude, and the steps are
compiled to machine code, so that the emulated board keeps up.
"""

from robotont_firmware.compat import const, micropython

MICRO = const(1000000)
PERIOD = const(20)  # [ms]

GOOD = const(0)  # encoders
UNPLUGGED = const(1)
REVERSED = const(2)
HALF = const(3)  # one channel is dead
FLOATING = const(4)  # unplugged, and noise of up to 2 edges a period

BRAKE = const(0)  # drivers, by the off phase: two switches short the motor, current flows either way
DIODE = const(1)  # one switch and a diode (VNH): current goes on falling, and never turns round
COAST = const(2)  # all switches open (MC33887, D2 low): the battery drives the current down
DROP = const(14)  # [units] 0.8 V of a diode
RISE = const(7)  # [0.1 ms] inductance over resistance


class SimMotor:
    """tau: [ms]. friction, breakaway (at rest; default: friction), load: [units]. battery: [%] of 12 V.

    driver: BRAKE, DIODE or COAST; frequency: [Hz] of its PWM. blocked: nothing turns it. powered: current reaches
    it. encoder: one of GOOD .. FLOATING.
    """

    def __init__(self, tau=60, friction=8, battery=100, full_effort=4000, no_load=208, driver=BRAKE, frequency=20000,
                 breakaway=0, load=0):  # fmt: skip
        self.tau = tau
        self.friction = friction * MICRO
        self.breakaway = max(friction, breakaway) * MICRO
        self.load = load * MICRO
        self.volts = no_load * 10 * battery  # [1/1000 unit]
        self.full_effort = full_effort
        self.driver, self.frequency = driver, frequency
        self.blocked = False
        self.powered = True
        self.encoder = GOOD
        self.times = self.part = 1  # edges that it counts for so many
        self.effort = 0
        self.speed = 0
        self.turned = 0  # [edges] that the wheel turned
        self.counted = 0  # [edges] of those that reach the board
        self._turned_part = self._counted_part = 0  # [millionths of an edge] 0..999999, on top of them
        self._phase = self._current = 0  # of slow pulses: [0.1 ms], [1/1000 unit]
        self._clock = 0  # [ms]
        self._random = 1

    def current(self):
        """Return the motor's mean current in [effort], whose 4000 are 5 A."""
        return self._torque(self.speed // 1000) * self.full_effort // 208000

    def drive(self, effort):
        """Set the voltage; more than the battery has is cut off."""
        self.effort = max(-self.full_effort, min(self.full_effort, effort))

    @micropython.viper
    def _torque(self, speed: int) -> int:
        """Return the torque [1/1000 unit] at a speed [1/1000 unit], friction not taken off."""
        effort, volts = int(self.effort), int(self.volts)
        if effort == 0 or not self.powered:
            return (0 - speed) // 8
        direction = 1 if effort > 0 else -1
        duty = effort * direction * 1000 // int(self.full_effort)
        emf = speed * direction
        driver, frequency = int(self.driver), int(self.frequency)
        if driver == BRAKE:
            return (volts * duty // 1000 - emf) * direction
        off = DROP * 1000 if driver == DIODE else volts + 2 * DROP * 1000
        if frequency < 1000:
            return int(self._slow_pulses(emf, duty, off)) * direction
        torque = (volts * duty - off * (1000 - duty)) // 1000 - emf  # if the current never ends
        ripple = (volts - emf) * duty // 1000 * (5000000 // RISE // frequency) // 1000
        if emf + off > 0:  # it may end in every pulse
            ended = ripple * duty // 1000 * ((volts + off) // 64) // ((emf + off) // 64 + 1)
            ripple = ripple if ripple < ended else ended
        torque = torque if torque > ripple else ripple
        return torque * direction if torque > 0 else 0

    @micropython.viper
    def _slow_pulses(self, emf: int, duty: int, off: int) -> int:
        """Return the mean torque of the next ms, in steps of 0.1 ms."""
        volts, phase, current = int(self.volts), int(self._phase), int(self._current)
        length = 10000 // int(self.frequency)
        total = 0
        for _ in range(10):
            on = length * duty - phase * 1000
            on = 0 if on < 0 else 1000 if on > 1000 else on
            current += (volts * on // 1000 - off * (1000 - on) // 1000 - emf - current) // RISE
            current = 0 if current < 0 else current
            total += current
            phase = phase + 1 if phase < length - 1 else 0
        self._phase, self._current = phase, current
        return total // 10

    @micropython.viper
    def run(self, milliseconds: int):
        speed = int(self.speed)
        turned, turned_part = int(self.turned), int(self._turned_part)
        counted, counted_part = int(self.counted), int(self._counted_part)
        tau, friction = int(self.tau), int(self.friction)
        breakaway, load = int(self.breakaway), int(self.load)
        encoder, clock, noise = int(self.encoder), int(self._clock), int(self._random)
        blocked = int(self.blocked)
        for _ in range(milliseconds):
            clock = clock + 1 if clock < PERIOD - 1 else 0
            if encoder == FLOATING and clock == 0:
                noise = (noise * 25173 + 13849) & 0xFFFF
                counted += (noise >> 8) % 5 - 2
            pull = int(self._torque(speed // 1000))
            pull = pull * 1000 - load
            still = speed == 0 and pull <= breakaway and pull >= 0 - breakaway
            if still or blocked:
                speed = 0
                continue
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
            elif encoder == GOOD or encoder == REVERSED:  # noqa: PLR1714, SIM109 (a tuple would be made)
                step = 0 - step if encoder == REVERSED else step
                counted_part += step
                counted += counted_part // MICRO
                counted_part -= counted_part // MICRO * MICRO
        self.speed = speed
        self.turned, self._turned_part = turned, turned_part
        self.counted, self._counted_part = counted, counted_part
        self._clock, self._random = clock, noise


class SimBoard:
    """The board interface of robotont_firmware.main_loop over simulated motors; time is the ticks.

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
        self.skip = 1
        self._next = [0] * len(motors)

    def wait_tick(self):
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
            motor = self.motors[index]
            totals[index] = motor.counted * motor.times // motor.part & 0xFFFF

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

