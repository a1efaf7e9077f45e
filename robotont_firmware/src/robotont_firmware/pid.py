"""Speed controller of one wheel in fixed-point integers: feed-forward, PI(D), limits.

Speeds are in 1/256 unit, gains in 1/256 effort per unit, so a product carries 2^16 and is shifted back.
Every intermediate value stays below 2^30 in magnitude; `Pid` refuses gains that could break that.
"""

from robotont_firmware.compat import micropython

MAX_COUNTS = 400  # [edges/period] twice the motor's reach; a larger difference is no speed
_LARGEST = 0x3FFFFFFF  # of the board's small integers


@micropython.native
def clamp(value, limit):
    """Return `value` brought into -limit..limit."""
    if value > limit:
        return limit
    if value < -limit:
        return -limit
    return value


class Pid:
    """One wheel. `config` holds the gains and limits that robotont_firmware.config describes.

    The set-point passes through a first-order model of how the wheel is able to follow; the feed-forward
    drives the wheel along it, and P and I only see what the wheel does differently. So a step does not
    charge the integral, and the sum of the errors, hence the distance, still comes out exact.

    Raises ValueError when a gain is negative or so large that 30 bits would not hold a product.
    """

    def __init__(self, config):
        speed = MAX_COUNTS * 256
        error = speed + config.MAX_SPEED * 256
        self._static = config.STATIC
        self._v = _checked(config.SPEED_GAIN, speed)
        self._p = _checked(config.P_GAIN, error)
        self._i = _checked(config.I_GAIN, 1)
        self._d = _checked(config.D_GAIN, 2 * speed)
        self._follow = _checked(config.FOLLOW, 2 * config.MAX_SPEED * 256)
        self._lead = _checked(config.LEAD, 2 * config.MAX_SPEED * 256)
        self._brake = _checked(config.BRAKE_GAIN, MAX_COUNTS)
        self._max_effort = config.MAX_EFFORT
        self._max_torque = config.MAX_TORQUE
        self._max_integral = self._integral_for(config.MAX_INTEGRAL, error)
        self._blocked_integral = self._integral_for(config.BLOCKED_INTEGRAL, error)
        self._blocked_error = config.BLOCKED_ERROR * 256
        self._standstill = config.STANDSTILL
        self.reset()

    def reset(self):
        """Forget the past: no integral, motor off until the next set-point other than 0."""
        self._integral = 0  # sum of errors [1/256 unit * period]
        self._reference = 0  # the speed that the wheel should have at the end of the period [1/256 unit]
        self._speed = 0
        self._still = self._standstill

    @micropython.native
    def brake(self, counts):
        """Return the effort that stops a wheel with `counts` edges in the past period; forget the past."""
        self.reset()
        return clamp(-self._brake * clamp(counts, MAX_COUNTS), self._max_effort)

    @micropython.native
    def step(self, setpoint, counts):
        """Return the effort for the coming period, within +-MAX_EFFORT.

        setpoint: wished speed [1/256 unit], within +-MAX_SPEED units. counts: edges of the past period.
        """
        if self._rests(setpoint, counts):
            self.reset()
            return 0
        speed = clamp(counts, MAX_COUNTS) << 8
        error = self._reference - speed
        self._advance(setpoint)
        wanted = (
            self._feed_forward(setpoint)
            + (self._p * error >> 16)
            + (self._i * self._integral >> 16)
            - (self._d * (speed - self._speed) >> 16)
        )
        self._speed = speed
        effort = self._limit(wanted, speed)
        # Anti-windup: while a limit holds the effort, an error that would push further is not summed.
        if not ((error > 0 and wanted > effort) or (error < 0 and wanted < effort)):
            self._integrate(error, counts)
        return effort

    @micropython.native
    def _advance(self, setpoint):
        """Bring the reference nearer to the set-point, and exactly there in the end."""
        change = self._follow * (setpoint - self._reference) >> 8
        self._reference = setpoint if change == 0 else self._reference + change

    @micropython.native
    def _integrate(self, error, counts):
        """Add to the integral; a wheel that should turn and does not charges it only a little."""
        limit = self._max_integral
        blocked = counts == 0 and (error > self._blocked_error or error < -self._blocked_error)
        if blocked and (error > 0) == (self._integral > 0):
            limit = max(self._blocked_integral, abs(self._integral))
        self._integral = clamp(self._integral + error, limit)

    @micropython.native
    def _rests(self, setpoint, counts):
        """Return True from STANDSTILL periods of set-point 0 without an edge until the next set-point."""
        if setpoint != 0:
            self._still = 0
        elif self._still < self._standstill:
            self._still = self._still + 1 if counts == 0 else 0
        return self._still >= self._standstill

    @micropython.native
    def _feed_forward(self, setpoint):
        """Return the effort that moves the wheel along the reference; STATIC bridges the dead-band."""
        ahead = self._reference + (self._lead * (setpoint - self._reference) >> 8)
        effort = self._v * clamp(ahead, MAX_COUNTS << 8) >> 16
        if setpoint > 0:
            return effort + self._static
        if setpoint < 0:
            return effort - self._static
        return effort

    @micropython.native
    def _limit(self, effort, speed):
        """Return the effort within MAX_TORQUE of the back-EMF, which bounds the current, and MAX_EFFORT."""
        emf = self._v * speed >> 16
        return clamp(emf + clamp(effort - emf, self._max_torque), self._max_effort)

    def _integral_for(self, effort, error):
        """Return the integral that adds `effort`; ValueError when adding one more error could overflow."""
        if not 0 <= effort <= _LARGEST >> 16:
            raise ValueError(f"an integral of {effort} effort is out of range")
        integral = 0 if self._i == 0 else (effort << 16) // self._i
        if integral > _LARGEST - error:
            raise ValueError(f"I_GAIN is too small for an integral of {effort} effort")
        return integral


def _checked(gain, largest):
    """Return `gain`; raise ValueError unless 0 <= gain and gain * largest fits."""
    if not 0 <= gain <= _LARGEST // largest:
        raise ValueError(f"gain {gain} is out of range")
    return gain
