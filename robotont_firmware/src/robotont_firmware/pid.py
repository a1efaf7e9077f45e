"""Speed controller of one wheel in fixed-point integers: feed-forward, PI(D), limits, and fault detection.

Speeds are in 1/256 unit, gains in 1/256 effort per unit, so a product carries 2^16 and is shifted back.
Every intermediate value stays below 2^30 in magnitude; robotont_firmware.bounds refuses what could break that.
"""

from robotont_firmware import bounds
from robotont_firmware.compat import const, micropython

MAX_COUNTS = const(400)  # [edges/period] twice the motor's reach; a larger difference is no speed
MAX_PERIODS = const(16)  # [periods] the most missed ticks that a step makes up for; the watchdog comes before

# What is wrong with a wheel; the packets' status field carries these numbers.
NO_FAULT = const(0)
DRIVER_FAULT = const(1)  # the motor driver's fault line
NO_COUNTS = const(2)  # driven, and the encoder shows no motion: unplugged, no motor current, or blocked
WRONG_WAY = const(3)  # driven, and the encoder counts against it: encoder or motor leads reversed
OVERLOAD = const(4)  # the motor has worked too hard for too long: its current is limited for now

_FLOOR = const(1280)  # [1/256 unit] 5 units: the least speed for which a blind wheel may be driven
_BLIND_PART = const(294)  # [1/256] a blind wheel is driven for at most 1.15 times its set-point
_BESIDE_PART = const(96)  # [1/256] or for three eighths of the fastest wheel's
_ONE_EDGE = const(256)  # [1/256 unit]
_WRONG_EDGES = const(4096)  # [1/256 edge] 16 edges backward are no tremor
_SEEN = const(3)  # [periods] of following that make an encoder credible until the wheel rests
_GRACE = const(25)  # [periods] that others may drag a wheel while the robot changes its motion
_GROWTH = const(2)  # [edges/period] by which a braked wheel may seem to grow faster


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
    drives the wheel along it, and P and I only act on the difference from it. So a step does not
    charge the integral, and the sum of the errors, hence the distance, still comes out exact: as long as the
    robot is driven. When all should stop, a wheel that has come to rest stays there: driven back to where it
    should have stopped, a heavy robot would swing.

    P and I are only as good as the encoder. While the counts do not show that the wheel follows it is
    *blind*: driven forward by at most what turns a free wheel at 1.15 times the set-point, so that a wheel
    without an encoder does not run away. Beside fast wheels, which load it sideways, it may be driven by what
    turns a free wheel at three eighths of the fastest set-point. When that has lasted for BLIND_TIME and the
    wheel owes BLIND_EDGES, and as much as the fastest wheel makes in two periods, `fault` is NO_COUNTS or
    WRONG_WAY until `reset`.

    `overloaded`: the motor had more than its continuous current for so long that only that is left.

    Raises ValueError when a number of `config` is out of range.
    """

    def __init__(self, config):
        bounds.check(config)
        battery = config.BATTERY
        self._static = bounds.at_battery(config.STATIC, battery)
        self._v = bounds.at_battery(config.SPEED_GAIN, battery)
        self._p = bounds.at_battery(config.P_GAIN, battery)
        self._i = bounds.at_battery(config.I_GAIN, battery)
        self._d = bounds.at_battery(config.D_GAIN, battery)
        self._brake = bounds.at_battery(config.BRAKE_GAIN, battery)
        self._follow = config.FOLLOW
        self._lead = config.LEAD
        self._max_effort = config.MAX_EFFORT
        self._max_torque = bounds.at_battery(config.MAX_TORQUE, battery)
        self._continuous = min(bounds.at_battery(config.CONTINUOUS_TORQUE, battery), self._max_torque)
        self._heating = (self._continuous >> 4) * (self._continuous >> 4)
        # Full torque for OVERLOAD_TIME brings a cold motor to the limit.
        self._max_heat = config.OVERLOAD_TIME * ((self._max_torque >> 4) * (self._max_torque >> 4) - self._heating)
        self._max_integral = bounds.integral_for(bounds.at_battery(config.MAX_INTEGRAL, battery), self._i)
        self._blocked_integral = bounds.integral_for(bounds.at_battery(config.BLOCKED_INTEGRAL, battery), self._i)
        self._standstill = config.STANDSTILL
        self._blind_time = config.BLIND_TIME
        self._blind_edges = config.BLIND_EDGES * 256
        self._heat = 0  # torque above the continuous one, squared and summed
        self.overloaded = False
        self.reset(0)

    @micropython.native
    def reset(self, periods=1):
        """Forget the past: no integral, no suspicion, motor off (and cooling) until the next set-point other than 0."""
        self._integral = 0  # sum of errors [1/256 unit * period]
        self._reference = 0  # the speed that the wheel should have at the end of the period [1/256 unit]
        self._speed = 0
        self._still = self._standstill
        self._direction = 0  # in which the wheel was driven last: -1, 0, 1
        self._effort = 0
        self._seen = 0  # [periods] in which the counts followed the effort
        self._grace = 0  # [periods] that the wheel may still be dragged backwards
        self.lag = 0  # [1/256 unit] by which a wheel with a credible encoder misses its reference
        self._braked = 0  # [edges/period] the least speed since braking began
        self.fault = NO_FAULT
        self._trust()
        self._warm(0, periods)

    @micropython.native
    def brake(self, counts, periods=1):
        """Return the effort that stops a wheel with `counts` edges in the past periods, within the current limit.

        Only a wheel that turns as it was driven is braked: with a reversed or missing encoder, or one
        whose counts grow while braking, it rolls.
        """
        ahead = self._per_period(counts, periods) * self._direction
        if ahead <= 0 or (self._braked > 0 and ahead > self._braked + _GROWTH):
            self.reset(periods)
            return 0
        if self._braked == 0 or ahead < self._braked:
            self._braked = ahead
        self._integral = 0
        self._reference = 0
        speed = ahead * self._direction << 8
        effort = self._limit(-self._brake * ahead * self._direction, speed)
        self._warm(effort - (self._v * speed >> 16), periods)
        return effort

    @micropython.native
    def step(self, setpoint, counts, periods=1, settled=True, fastest=0):
        """Return the effort for the coming period, within +-MAX_EFFORT.

        setpoint: wanted speed [1/256 unit], within +-MAX_SPEED units. counts: edges since the last call.
        periods: how many control periods those took; more than one when the board missed ticks. settled:
        whether the robot as a whole moves as it should, so that no other wheel drags this one. fastest: the
        largest set-point of all wheels, without sign [1/256 unit].
        """
        if self._rests(setpoint, counts):
            self.reset(periods)
            return 0
        periods = min(periods, MAX_PERIODS)
        counts = clamp(counts, MAX_COUNTS * periods)
        speed = counts << 8
        if periods > 1:
            speed = speed // periods
        error = self._reference - speed
        if setpoint == 0 and fastest == 0 and self._stopped(speed):
            self._integral = 0
        blind = self._doubt(setpoint, speed, periods, settled, fastest)
        self._advance(setpoint)
        wanted = (
            self._feed_forward(setpoint)
            + (self._p * error >> 16)
            + (self._i * self._integral >> 16)
            - (self._d * (speed - self._speed) >> 16)
        )
        self._speed = speed
        self.lag = 0 if blind else abs(error)
        if blind:
            effort = self._limit_blind(wanted, setpoint, fastest)
            self._warm(effort, periods)
        else:
            effort = self._limit(wanted, speed)
            self._warm(effort - (self._v * speed >> 16), periods)
        # Anti-windup: while a limit holds the effort, an error that would push further is not summed.
        if not ((error > 0 and wanted > effort) or (error < 0 and wanted < effort)):
            self._integrate(error * periods, self._blocked_integral if blind else self._max_integral)
        self._effort = effort
        return effort

    @micropython.native
    def _per_period(self, counts, periods):
        """Return the edges per period, within +-MAX_COUNTS."""
        if periods > 1:
            counts = counts // periods
        return clamp(counts, MAX_COUNTS)

    @micropython.native
    def _doubt(self, setpoint, speed, periods, settled, fastest):
        """Return True while the counts do not show that the wheel follows; set `fault` when that lasts."""
        if setpoint != 0:
            self._direction = 1 if setpoint > 0 else -1
        wished = self._reference * self._direction
        ahead = speed * self._direction
        push = self._effort * self._direction
        # One edge now and then is what is left of an encoder with one dead channel.
        if ahead >= 0 and (ahead > _ONE_EDGE or ahead >= wished):
            if ahead > _ONE_EDGE and push > self._static:
                self._grace = _GRACE if self._seen >= _SEEN else 0
                self._seen += 1 if self._seen < _SEEN else 0
            self._trust()
            return False
        if self._effort == 0 and ahead < -_ONE_EDGE:
            self._grace = _GRACE  # it rolled before it was driven
        if self._grace > 0 and self._blind == 0 and (not settled or self._grace < _GRACE):
            # While the robot changes its motion the other wheels may hold or drag one that followed before. One that
            # stops following while the robot moves as it should gets no grace, whatever that does to the others.
            self._grace -= periods
            return self._seen < _SEEN
        if push > self._static + (self._v * wished >> 17):  # driven for half of the reference or more
            self._blind += periods
            most = max(self._blind_edges, fastest * 2)
            self._ahead = clamp(self._ahead + ahead * periods, most)
            self._owed += (wished - ahead) * periods
            if self._owed < 0:
                self._owed = 0
            elif self._owed > most:
                self._owed = most
                if self._blind >= (self._blind_time if settled else _GRACE):
                    self.fault = WRONG_WAY if self._ahead < -_WRONG_EDGES else NO_COUNTS
        if ahead >= 0 and ahead * 4 >= wished:
            return False
        if push <= 0 and self._integral * self._direction < 0:  # left over from the motion before
            self._integral = 0
        return True

    @micropython.native
    def _trust(self):
        """The encoder shows that the wheel follows."""
        self._blind = 0  # [periods] without such counts
        self._owed = 0  # [1/256 edge] that the wheel should have turned meanwhile and did not
        self._ahead = 0  # [1/256 edge] that it did turn; negative: the wrong way

    @micropython.native
    def _advance(self, setpoint):
        """Bring the reference nearer to the set-point, and exactly there in the end."""
        change = self._follow * (setpoint - self._reference) >> 8
        self._reference = setpoint if change == 0 else self._reference + change

    @micropython.native
    def _integrate(self, error, limit):
        """Add to the integral, up to `limit`; what it holds already it may keep."""
        self._integral = clamp(self._integral + error, max(limit, abs(self._integral)))

    @micropython.native
    def _rests(self, setpoint, counts):
        """Return True from STANDSTILL periods of set-point 0 without an edge until the next set-point."""
        if setpoint != 0:
            self._still = 0
        elif self._still < self._standstill:
            self._still = self._still + 1 if counts == 0 else 0
        return self._still >= self._standstill

    @micropython.native
    def _stopped(self, speed):
        """Return True where a wheel of a robot that should stop no longer turns as it was driven."""
        return speed * self._direction <= 0 and abs(self._reference) < _ONE_EDGE

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
        """Return the effort within the torque limit around the back-EMF, which bounds the current, and MAX_EFFORT."""
        emf = self._v * speed >> 16
        torque = self._continuous if self.overloaded else self._max_torque
        return clamp(emf + clamp(effort - emf, torque), self._max_effort)

    @micropython.native
    def _limit_blind(self, effort, setpoint, fastest):
        """Return the effort forward, at most what turns a free wheel as fast as a blind one may."""
        speed = max(max(abs(setpoint), _FLOOR) * _BLIND_PART, fastest * _BESIDE_PART) >> 8
        most = min(self._static + (self._v * speed >> 16), self._max_effort)
        torque = self._continuous if self.overloaded else self._max_torque
        return max(0, min(effort * self._direction, most, torque)) * self._direction

    @micropython.native
    def _warm(self, torque, periods):
        """Sum what the motor's current heats it more than its continuous current would; it cools as slowly."""
        torque = abs(torque) >> 4
        heat = self._heat + (torque * torque - self._heating) * periods
        self.overloaded = heat >= self._max_heat
        self._heat = max(0, min(heat, self._max_heat))
