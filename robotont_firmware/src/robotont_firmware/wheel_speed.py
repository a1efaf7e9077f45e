"""Speed controller of one wheel in fixed-point integers: feed-forward, PI(D), and limits.

Speeds are in 1/256 unit, gains in 1/256 effort per unit, so a product carries 2^16 and is shifted back.
Every intermediate value stays below 2^30 in magnitude; robotont_firmware.gain_bounds refuses what could break that.
"""

from robotont_firmware import gain_bounds as bounds
from robotont_firmware.compat import const, micropython
from robotont_firmware.fault_watch import NO_FAULT, TOO_MANY, FaultWatch

MAX_COUNTS = const(400)  # [edges/period] twice the motor's reach; a larger difference is no speed
_FASTEST = const(MAX_COUNTS << 8)  # [1/256 unit]
MAX_PERIODS = const(16)  # [periods] the most missed ticks that a step makes up for; the watchdog comes before

_SLOW = const(256)  # [1/256 unit] a wheel that should turn slower than twice this tells nothing by standing still
_GROWTH = const(512)  # [1/256 unit] by which a braked wheel may seem to grow faster
_EDGE = const(256)  # [1/256 unit]
_CREEPS = const(2560)  # [1/256 unit] a wheel that is no faster may be held,
_FOLLOWS = const(1024)  # [1/256 unit] one that is as fast follows its effort
_BRAKES = const(0)  # stages of a stop
_ROLLS = const(1)
_HOLDS = const(2)


@micropython.viper
def clamp(value: int, limit: int) -> int:
    """Return `value` brought into -limit..limit."""
    if value > limit:
        return limit
    if value < 0 - limit:
        return 0 - limit
    return value


class Pid:
    """One wheel. `config` holds the gains and limits that robotont_firmware.config describes.

    The set-point passes through a first-order model of how the wheel is able to follow; the feed-forward
    drives the wheel along it, and P and I only act on the difference from it. So a step does not
    charge the integral, and the sum of the errors, hence the distance, still comes out exact: as long as the
    robot is driven. When all stand, `stop` holds each wheel where it came to rest.

    P and I are only as good as the encoder: a FaultWatch bounds the effort, and `fault` is what it found, until
    `reset`.

    `overloaded`: the motor had more than its continuous current for so long that only that is left.

    Raises ValueError when a number of `config` is out of range.
    """

    def __init__(self, config):
        bounds.check(config)
        battery = config.BATTERY
        self._static = bounds.at_battery(config.STATIC, battery)
        self._v = bounds.at_battery(config.SPEED_GAIN, battery)  # the back-EMF of a unit
        self._coasts = config.DRIVER == "coast"
        self._forward = 0 if self._coasts else self._v  # what a unit more takes
        self._p = bounds.at_battery(config.P_GAIN, battery)
        self._i = bounds.at_battery(config.I_GAIN, battery)
        self._d = bounds.at_battery(config.D_GAIN, battery)
        self._brake = bounds.at_battery(config.BRAKE_GAIN, battery)
        self._follow = config.FOLLOW
        self._lead = config.LEAD
        self._turn_lead = config.TURN_LEAD
        self._full = config.FULL_EFFORT
        self._max_effort = config.MAX_EFFORT
        self._max_torque = bounds.at_battery(config.MAX_TORQUE, battery)
        self._continuous = min(bounds.at_battery(config.CONTINUOUS_TORQUE, battery), self._max_torque)
        self._heating = (self._continuous >> 4) * (self._continuous >> 4)
        # Full torque for OVERLOAD_TIME brings a cold motor to the limit.
        self._max_heat = config.OVERLOAD_TIME * ((self._max_torque >> 4) * (self._max_torque >> 4) - self._heating)
        self._max_integral = bounds.integral_for(bounds.at_battery(config.MAX_INTEGRAL, battery), self._i)
        self._blocked_integral = bounds.integral_for(bounds.at_battery(config.BLOCKED_INTEGRAL, battery), self._i)
        self._stiffness = bounds.at_battery(config.STIFFNESS, battery)
        self._most_away = bounds.integral_for(self._max_torque, self._stiffness)
        self._reach = bounds.reach(config)
        self._heat = 0  # torque above the continuous one, squared and summed
        self.overloaded = False
        self._watch = FaultWatch(config, self._forward)
        self.reset(0)

    @micropython.native
    def reset(self, periods=1):
        """Forget the past: no integral, no suspicion, motor off (and cooling) until the next set-point other than 0."""
        self._integral = 0  # sum of errors [1/256 unit * period]
        self.reference = 0  # the speed that the wheel should have at the end of the period [1/256 unit]
        self._mean = 0  # and on the mean over it, which its edges are
        self._speed = 0
        self._ahead = 0  # effort that the change of motion takes
        self._push = 0  # effort, without what the change of motion takes
        self.lag = 0  # [1/256 unit] by which it misses its reference
        self._beyond = 0  # [periods] in a row in which it counted more than the motor can make
        self._stage = _HOLDS
        self._soft = 0  # halvings of the effort of a stop
        self._away = 0  # [1/256 edge] by which it was moved while it should stand
        self._braked = _FASTEST  # [1/256 unit] the least speed since braking began
        self._proved = False  # whether it was seen to follow its effort
        self.fault = NO_FAULT
        self._limited = False
        self._watch.reset()
        self._warm(0, 0, periods)

    @micropython.native
    def stop(self, counts, periods=1, holds=False):
        """Return the effort that stops a wheel with `counts` edges in the past periods; if it `holds`, keeps it there.

        Never along the motion that is counted. Out of a drive only a wheel that turns as it was driven is braked: with
        a reversed or missing encoder, or one whose counts grow while braking, it rolls until it is slow.
        """
        periods = max(1, min(periods, MAX_PERIODS))
        speed = (clamp(counts, MAX_COUNTS * periods) << 8) // periods
        self.fault = TOO_MANY if self._exceeds(counts, periods) else NO_FAULT
        self._integral = self.reference = self._mean = 0
        effort = self._against(speed, speed * self._watch.direction(), periods if holds else 0)
        self._warm(effort, speed, periods)
        return effort

    @micropython.native
    def step(self, setpoint, counts, periods=1, settled=True, fastest=0, straight=0, turning=0):
        """Return the effort for the coming period, within +-MAX_EFFORT.

        setpoint: wanted speed [1/256 unit], within +-MAX_SPEED units. counts: edges since the last call.
        periods: how many control periods those took; more than one when the board missed ticks. settled:
        whether the robot as a whole moves as it should, so that no other wheel drags this one. fastest: the
        largest set-point of all wheels, without sign [1/256 unit]. straight, turning: the acceleration of the robot
        in this period, in the wheel's direction, apart from the change of its own reference [1/256 unit].
        """
        if periods > MAX_PERIODS:  # noqa: PLR1730 (min() costs 700 instructions)
            periods = MAX_PERIODS
        speed = clamp(counts, MAX_COUNTS * periods) << 8
        if periods > 1:
            speed = speed // periods
        watch = self._watch
        error = self._mean - speed
        self.fault = watch.look(
            setpoint, self.reference, speed, self._push, self._limited, periods, settled, fastest)  # fmt: skip
        if self._exceeds(counts, periods):
            self.fault = TOO_MANY
        steady = self._steady(setpoint, speed, error, straight, turning)
        bound = watch.bound(steady)
        effort = self._limit(bound + self._ahead, speed)
        if effort * speed > 0 and (speed if speed > 0 else -speed) > _FOLLOWS:
            self._proved = True
        self._stage, self._braked, self._soft = _BRAKES, _FASTEST, 0
        self._warm(effort, speed, periods)
        self._note(steady, bound, effort, error, periods)
        return effort

    @micropython.viper
    def _against(self, speed: int, ahead: int, periods: int) -> int:
        """Return the effort against a speed and, over these periods, against the way that the wheel was moved at rest.

        ahead: the speed in the direction in which it was driven.
        """
        fast = speed if speed > 0 else 0 - speed
        before = int(self._speed)
        if (before > _FOLLOWS and speed < 0 - _FOLLOWS) or (before < 0 - _FOLLOWS and speed > _FOLLOWS):
            self._soft = int(self._soft) + 1 & 7  # it was turned round: half of the effort is enough
        self._speed = speed
        stage, least = int(self._stage), int(self._braked)
        if fast <= _CREEPS:
            stage = _HOLDS
        if stage == _BRAKES or periods == 0:
            if ahead <= 0 or ahead > least + _GROWTH:
                stage = _ROLLS
            self._braked = ahead if ahead < least else least
        elif fast > _CREEPS and not self._proved:
            stage = _ROLLS
        self._stage = stage
        if stage == _ROLLS:
            self._away = 0
            return 0
        away, most = int(self._away), int(self._most_away)
        away = away + speed * periods if stage == _HOLDS else 0
        away = most if away > most else 0 - most if away < 0 - most else away
        clear = fast - _EDGE  # one edge is a creep, or a tremor
        clear = 0 if clear < 0 else clear if speed > 0 else 0 - clear
        effort = 0 - (int(self._brake) * clear >> 8) - (int(self._stiffness) * away >> 16) >> int(self._soft)
        if clear != 0 and ((effort > 0 and speed > 0) or (effort < 0 and speed < 0)):
            away -= away >> 2  # it goes back: less is enough
        self._away = away
        effort = int(self._limit(effort, speed))
        return 0 if (effort > 0 and speed > 0) or (effort < 0 and speed < 0) else effort

    @micropython.viper
    def _exceeds(self, counts: int, periods: int) -> bool:
        """Return True in the third period in a row that brings more edges than the motor can make."""
        beyond = int(self._beyond) + periods
        if (counts if counts > 0 else 0 - counts) <= int(self._reach) * periods:
            beyond = 0
        self._beyond = beyond
        return beyond >= 3

    @micropython.viper
    def _steady(self, setpoint: int, speed: int, error: int, straight: int, turning: int) -> int:
        """Bring the reference nearer to the set-point, and exactly there in the end; return the effort to follow it.

        Feed-forward turns the wheel as fast as the reference, where STATIC bridges the dead-band, and P, I and D act on
        the error. What the change of motion takes besides is `_ahead`; where the wheel is not seen to follow, it is a
        part of the effort, as bounded as the rest.
        """
        before = int(self.reference)
        change = int(self._follow) * (setpoint - before) + 128 >> 8  # rounded: if all lag one way, the robot turns
        reference = setpoint if change == 0 else before + change
        self.reference = reference
        self._mean = reference - (reference >> 1) + (before >> 1)  # what is rounded off adds up to nothing
        ahead = int(self._lead) * (change + straight) + int(self._turn_lead) * turning >> 4
        ahead = _FASTEST if ahead > _FASTEST else 0 - _FASTEST if ahead < 0 - _FASTEST else ahead
        forward = int(self._forward)
        ahead = forward * ahead >> 16
        static = int(self._static)
        effort = forward * reference >> 16
        effort += static if setpoint > 0 else 0 - static if setpoint < 0 else 0
        effort += int(self._p) * (error >> 1) >> 15  # half the error: twice the gain stays below 2^30
        effort += int(self._i) * int(self._integral) >> 16
        effort -= int(self._d) * (speed - int(self._speed)) >> 16
        self._speed = speed
        before >>= 1
        if (before > _SLOW and speed < before) or (before < 0 - _SLOW and speed > before):
            effort += ahead
            ahead = 0
        self._ahead = ahead
        return effort

    @micropython.viper
    def _note(self, steady: int, bound: int, effort: int, error: int, periods: int):
        """Remember what this period has shown, and add the error to the integral, up to its limit.

        What it holds already it may keep. Anti-windup: while a limit holds the effort, an error that would push further
        is not summed.
        """
        wanted = steady + int(self._ahead)
        cut = effort - bound - int(self._ahead)  # by the motor's limits
        self._limited = bool(effort != wanted)
        self._push = bound + cut if (bound > 0 and cut < 0) or (bound < 0 and cut > 0) else bound
        self.lag = error if error > 0 else 0 - error
        if (error > 0 and wanted > effort) or (error < 0 and wanted < effort):
            return
        limit = int(self._max_integral) if bound == steady else int(self._blocked_integral)
        before = int(self._integral)
        limit = before if before > limit else 0 - before if 0 - before > limit else limit
        after = before + error * periods
        self._integral = limit if after > limit else 0 - limit if after < 0 - limit else after

    @micropython.viper
    def _limit(self, effort: int, speed: int) -> int:
        """Return the effort within the torque limit around the back-EMF, which bounds the current, and MAX_EFFORT."""
        emf = 0 if self._coasts else int(self._v) * speed >> 16
        torque = int(self._continuous) if self.overloaded else int(self._max_torque)
        most = int(self._max_effort)
        effort -= emf
        effort = emf + (torque if effort > torque else 0 - torque if effort < 0 - torque else effort)
        return most if effort > most else 0 - most if effort < 0 - most else effort

    @micropython.viper
    def _warm(self, effort: int, speed: int, periods: int):
        """Sum what the motor's current heats it more than its continuous current would; it cools as slowly.

        That current is told as the effort that gives it at rest.
        """
        emf = int(self._v) * speed >> 16
        if self._coasts and effort * emf > 0:
            emf = effort * emf // int(self._full)
        torque = effort - emf
        torque = (torque if torque > 0 else 0 - torque) >> 4
        most = int(self._max_heat)
        heat = int(self._heat) + (torque * torque - int(self._heating)) * periods
        self.overloaded = bool(heat >= most)
        self._heat = most if heat > most else heat if heat > 0 else 0
