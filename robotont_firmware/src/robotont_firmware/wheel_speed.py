"""Speed controller of one wheel in fixed-point integers: feed-forward, PI and limits.

Speeds are fine units, gains carry 2^16 (robot_numbers), so that a product is shifted back; every intermediate value
stays below 2^30 in magnitude.
"""

from robotont_firmware.compat import const, micropython
from robotont_firmware.fault_watch import NO_FAULT, FaultWatch
from robotont_firmware.robot_numbers import MAX_PERIODS

_BRAKES = const(0)  # stages of a stop
_ROLLS = const(1)
_HOLDS = const(2)
_SOFTEST = const(7)
_PATIENCE = const(5)  # [control periods] without an edge, after which a wheel gets more


@micropython.viper
def clamp(value: int, limit: int) -> int:
    """Return `value` brought into -limit..limit."""
    if value > limit:
        return limit
    if value < 0 - limit:
        return 0 - limit
    return value


class Pid:
    """One wheel, by the `Numbers` of a configuration.

    The set-point passes through a first-order model of how the wheel is able to follow; the feed-forward
    drives the wheel along it, and P and I only act on the difference from it. So a step does not
    charge the integral, and the sum of the errors, hence the distance, still comes out exact: as long as the
    robot is driven. When all stand, `stop` holds each wheel where it came to rest.

    `fault` is what the FaultWatch found, until `reset`. `overloaded`: the motor had more than its continuous current
    for so long that only that is left.
    """

    def __init__(self, config, numbers):
        n = numbers
        self._shift, self._most_edges, self._free = n.shift, n.most_edges, n.free
        self._static, self._v, self._p, self._i = n.static, n.gain, n.p, n.i
        self._coasts = n.coasts
        self._forward = 0 if n.coasts else n.gain  # what a speed more takes
        self._brake, self._follow, self._lead, self._turn_lead = n.brake, n.follow, n.lead, n.turn_lead
        self._full, self._max_effort, self._load = n.full, n.max_effort, n.load
        self._max_torque, self._continuous = n.max_torque, n.continuous
        self._heating = (n.continuous >> 4) * (n.continuous >> 4)
        # Full torque for OVERLOAD_TIME brings a cold motor to the limit.
        self._max_heat = n.overload * ((n.max_torque >> 4) * (n.max_torque >> 4) - self._heating)
        self._max_integral = (n.load << 16) // n.i
        self._stiffness = n.stiffness
        self._most_away = (n.max_torque << 16) // n.stiffness
        self._edge, self._creeps, self._follows, self._growth = 1 << n.shift, n.creeps, n.follows, n.growth
        self._second = n.periods(config, 1000)
        self._heat = 0  # torque above the continuous one, squared and summed
        self._turned_round = 0  # [periods] for which it is remembered that the wheel was
        self._softness = 0  # halvings of what counts ask for: an encoder that counts too much makes it swing
        self.overloaded = False
        self._watch = FaultWatch(config, n)
        self.reset(0)

    @micropython.native
    def reset(self, periods=1):
        """Forget the past: no integral, no suspicion, motor off (and cooling) until the next set-point other than 0."""
        self._integral = 0  # sum of errors [fine units]
        self.reference = 0  # the speed that the wheel should have at the end of the period
        self._mean = 0  # and on the mean over it, which its edges are
        self._speed = 0
        self._effort = 0
        self._direction = 0  # in which it was driven last
        self._stage = _HOLDS
        self._idle = 0  # [periods] without an edge
        self._away = 0  # [fine units] by which it was moved while it should stand
        self._braked = self._free  # the least speed since braking began
        self._proved = False  # whether it was seen to follow its effort
        self.fault = NO_FAULT
        self._watch.reset()
        self._warm(0, 0, periods)

    @micropython.native
    def stop(self, counts, periods=1, holds=False):
        """Return the effort that stops a wheel with `counts` edges in the past periods; if it `holds`, keeps it there.

        Never along the motion that is counted. Out of a drive only a wheel that turns as it was driven is braked: with
        a reversed or missing encoder, or one whose counts grow while braking, it rolls until it is slow.
        """
        periods = max(1, min(periods, MAX_PERIODS))
        speed = self._measure(counts, periods)
        self._integral = self.reference = self._mean = 0
        if self.fault == NO_FAULT and self._effort == 0 and holds:
            self.fault = self._watch.rests(speed, periods)
        effort = self._against(speed, speed * self._direction, periods if holds else 0)
        self._effort = effort
        self._warm(effort, speed, periods)
        return effort

    @micropython.native
    def step(self, setpoint, counts, periods=1, straight=0, turning=0):
        """Return the effort for the coming period, within +-MAX_EFFORT.

        setpoint: wanted speed, within the largest. counts: edges since the last call. periods: how many control
        periods those took; more than one when the board missed ticks. straight, turning: the acceleration of the robot
        in this period, in the wheel's direction, apart from the change of its own reference.
        """
        periods = max(1, min(periods, MAX_PERIODS))
        speed = self._measure(counts, periods)
        if self._stage == _HOLDS:  # what held it on a slope goes on
            self._integral = clamp((self._effort << 16) // self._i, self._max_integral)
        error = clamp(self._mean - speed, self._free >> 1)
        if self.fault == NO_FAULT:
            self.fault = self._watch.driven(self._mean, speed, self._effort, periods)
        effort = self._follow_up(setpoint, speed, error, straight, turning, periods)
        if effort * speed > 0 and abs(speed) > self._follows:
            self._proved = True
        if setpoint != 0:
            self._direction = 1 if setpoint > 0 else -1
        self._stage, self._braked, self._away = _BRAKES, self._free, 0
        self._effort = effort
        self._warm(effort, speed, periods)
        return effort

    @micropython.native
    def _measure(self, counts, periods):
        """Return the speed, and note whether the motor can make it, and whether it was turned round at once."""
        speed = (clamp(counts, self._most_edges * periods) << self._shift) // periods
        self.fault = self._watch.exceeds(speed, periods)
        self._soften(speed, periods)
        return speed

    @micropython.viper
    def _soften(self, speed: int, periods: int):
        """Halve what counts ask for, for a second, each time that the wheel is turned round, against its aim."""
        before, least = int(self._speed), int(self._follows)
        self._speed = speed
        left, second = int(self._turned_round), int(self._second)
        mean = int(self._mean)
        if (before > least and speed < 0 - least and mean >= 0) or (
                before < 0 - least and speed > least and mean <= 0):
            left = left + second
            most = second * _SOFTEST
            left = left if left < most else most
        elif left > 0:
            left -= periods
        else:
            return
        self._turned_round = left
        self._softness = (left + second - 1) // second if left > 0 else 0

    @micropython.viper
    def _against(self, speed: int, ahead: int, periods: int) -> int:
        """Return the effort against a speed and, over these periods, against the way that the wheel was moved at rest.

        ahead: the speed in the direction in which it was driven.
        """
        fast = speed if speed > 0 else 0 - speed
        creeps = int(self._creeps)
        stage, least = int(self._stage), int(self._braked)
        if fast <= creeps:
            stage = _HOLDS
        if stage == _BRAKES or periods == 0:
            if ahead <= 0 or ahead > least + int(self._growth):
                stage = _ROLLS
            self._braked = ahead if ahead < least else least
        elif fast > creeps and not self._proved:
            stage = _ROLLS
        self._stage = stage
        if stage == _ROLLS:
            self._away = 0
            return 0
        away, most = int(self._away), int(self._most_away)
        away = away + speed * periods if stage == _HOLDS else 0
        away = most if away > most else 0 - most if away < 0 - most else away
        clear = fast - int(self._edge)  # one edge is a creep, or a tremor
        quarter = int(self._free) >> 2
        clear = 0 if clear < 0 else quarter if clear > quarter else clear
        clear = clear if speed > 0 else 0 - clear
        effort = 0 - (int(self._brake) * clear >> 16) - (int(self._stiffness) * away >> 16) >> int(self._softness)
        if clear != 0 and ((effort > 0 and speed > 0) or (effort < 0 and speed < 0)):
            away -= away >> 2  # it goes back: less is enough
        self._away = away
        if (effort > 0 and speed > 0) or (effort < 0 and speed < 0):
            return 0
        return int(self._limit(effort, speed))

    @micropython.viper
    def _follow_up(self, setpoint: int, speed: int, error: int, straight: int, turning: int, periods: int) -> int:
        """Bring the reference nearer to the set-point, and exactly there in the end; return the effort to follow it.

        Feed-forward turns the wheel as fast as the reference, where STATIC bridges the dead-band, and changes its
        motion; P and I act on the error, with no more than a load may need. Anti-windup: an error is not summed that
        would push further than a limit. A wheel that does not move gets more by and by, as fast as if it were slower.
        """
        before = int(self.reference)
        change = int(self._follow) * (setpoint - before) + 128 >> 8  # rounded: if all lag one way, the robot turns
        reference = setpoint if change == 0 else before + change
        self.reference = reference
        self._mean = reference - (reference >> 1) + (before >> 1)  # what is rounded off adds up to nothing
        ahead = int(self._lead) * (change + straight) + int(self._turn_lead) * turning >> 4
        free, forward = int(self._free), int(self._forward)
        ahead = free if ahead > free else 0 - free if ahead < 0 - free else ahead
        static = int(self._static)
        fed = (forward * reference >> 16) + (forward * ahead >> 16)
        fed += static if setpoint > 0 else 0 - static if setpoint < 0 else 0
        idle = int(self._idle) + periods if speed == 0 else 0
        self._idle = idle
        summed, least, slow = error, int(self._follows), int(self._edge) >> 2
        if idle > _PATIENCE and before > slow:
            summed = least if error < least else error
        elif idle > _PATIENCE and before < 0 - slow:
            summed = 0 - least if error > 0 - least else error
        soft, load = int(self._softness), int(self._load)
        integral, gain = int(self._integral), int(self._i)
        wanted = (int(self._p) * (error >> 1) >> 15 + soft) + (gain * integral >> 16)
        added = load if wanted > load else 0 - load if wanted < 0 - load else wanted
        effort = int(self._limit(fed + added, speed))
        cut = fed + wanted - effort
        if not ((summed > 0 and cut > 0) or (summed < 0 and cut < 0)):
            most = int(self._max_integral)
            integral += (summed >> soft) * periods
            self._integral = most if integral > most else 0 - most if integral < 0 - most else integral
        return effort

    @micropython.viper
    def _limit(self, effort: int, speed: int) -> int:
        """Return the effort within the torque limit around the back-EMF, which bounds the current, and MAX_EFFORT.

        No limit turns an effort round: the back-EMF is only what the encoder counts.
        """
        wanted = effort
        emf = 0 if self._coasts else int(self._v) * speed >> 16
        torque = int(self._continuous) if self.overloaded else int(self._max_torque)
        most = int(self._max_effort)
        effort -= emf
        effort = emf + (torque if effort > torque else 0 - torque if effort < 0 - torque else effort)
        if (wanted >= 0 and effort < 0) or (wanted <= 0 and effort > 0):
            return 0
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
