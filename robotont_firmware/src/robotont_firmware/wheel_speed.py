"""Speed controller of one wheel in fixed-point integers: feed-forward, PI and limits.

Speeds are fine units, gains carry 2^16 (robot_numbers), so that a product is shifted back; every intermediate value
stays below 2^30 in magnitude. All that a wheel knows lies in one array: to look an attribute up costs the board more
than to calculate with it.
"""

from array import array

from robotont_firmware.compat import SIGN, const, micropython, ptr32
from robotont_firmware.fault_watch import NO_FAULT, STILL, TIMES, WRONG, drive_fault, rest_fault, speed_fault
from robotont_firmware.robot_numbers import FULL_EFFORT, in_periods

_SOFTEST = const(7)
_PATIENCE = const(5)  # [periods] without an edge, after which a wheel gets more

_FOLLOWS = const(0)  # places in the array: those of fault_watch,
_EDGE = const(4)
INTEGRAL = const(13)  # of its past: sum of errors [fine units]
REFERENCE = const(14)  # the speed that the wheel should have at the end of the period
MEAN = const(15)  # and on the mean over it, which its edges are
_SPEED = const(16)
_EFFORT = const(17)
_EXCESS = const(18)  # that it asked for above seven eighths of MAX_LOAD, or that its limits took away
_DIRECTION = const(19)  # in which it was driven last
_HELD = const(20)  # whether it came to rest, and is kept there
_IDLE = const(21)  # [periods] without an edge
_AWAY = const(22)  # [fine units] by which it was moved while it should stand
_PROVED = const(23)  # 1: it was seen to follow its effort; 2: against it, as a reversed encoder counts; 3: in a trial
_ROLLS = const(24)  # [periods] for which it is only shorted, and then tried to be braked, and gets no slower
_LEAST = const(25)  # than this speed, the least of them
HEAT = const(26)  # and what `reset` keeps of it: torque above the continuous one, squared and summed;
_TURNED_ROUND = const(27)  # [periods] for which it is remembered that the wheel was
_SOFTNESS = const(28)  # halvings of what counts ask for: an encoder that counts too much makes it swing
_LOOSE = const(29)  # [periods] for which it is only shorted: what should brake it made it no slower
_STATIC = const(30)  # and of the configuration
_LOAD = const(31)
_GAIN = const(32)
_FORWARD = const(33)  # what a speed more takes; 0 with drivers that coast
_P = const(34)
_I = const(35)
_FOLLOW = const(36)
_LEAD = const(37)
_MAX_EFFORT = const(38)
_MAX_TORQUE = const(39)
_CONTINUOUS = const(40)
_MAX_HEAT = const(41)
_STIFFNESS = const(42)
_FREE = const(43)
_CREEPS = const(44)
_SECOND = const(45)


@micropython.viper
def measure(numbers, counts: int, periods: int) -> int:
    """Return the speed.

    Halve what counts ask for, twice and for a second each, where the wheel is turned round at once, against its aim.
    """
    n, sign = ptr32(numbers), int(SIGN)
    most = 2 * n[_FREE] // n[_EDGE] * periods  # more are no speed
    counts = most if counts > most else 0 - most if counts < 0 - most else counts
    speed = counts * n[_EDGE] // periods
    before, mean = n[_SPEED] << sign >> sign, n[MEAN] << sign >> sign
    least = n[_FOLLOWS] if mean else n[_FOLLOWS] * 3 >> 2
    n[_SPEED] = speed
    left, second = n[_TURNED_ROUND] << sign >> sign, n[_SECOND]
    if (before > least and speed < 0 - least and mean >= 0) or (
            before < 0 - least and speed > least and mean <= 0):
        left = left + 2 * second if left < second * (_SOFTEST - 2) else second * _SOFTEST
    elif left > 0:
        left -= periods
    n[_TURNED_ROUND] = left
    n[_SOFTNESS] = (left + second - 1) // second if left > 0 else 0
    return speed


@micropython.viper
def far_away(away: int, edge: int) -> int:
    """Return the way that a wheel that should stand was moved, beyond an edge: within one it stands."""
    return away - edge if away > edge else away + edge if away < 0 - edge else 0


@micropython.viper
def follow_up(numbers, setpoint: int, speed: int, error: int, bend: int, periods: int) -> int:
    """Bring the reference nearer to the set-point, and exactly there in the end; return the effort to follow it.

    Feed-forward turns the wheel as fast as the reference, where STATIC bridges the dead-band, and changes its
    motion; P and I act on the error: they add what a load may need at most, and take away all. Anti-windup: an
    error is not summed that would push further than a limit. A wheel that does not move gets more by and by, as
    fast as if it were slower.
    """
    n, sign = ptr32(numbers), int(SIGN)
    before = n[REFERENCE] << sign >> sign
    change = n[_FOLLOW] * (setpoint - before) + 128 >> 8  # rounded: if all lag one way, the robot turns
    reference = setpoint if change == 0 else before + change
    n[REFERENCE] = reference
    n[MEAN] = reference - (reference >> 1) + (before >> 1)  # what is rounded off adds up to nothing
    ahead = n[_LEAD] * change + bend >> 4
    free, forward, static = n[_FREE], n[_FORWARD], n[_STATIC]
    ahead = free if ahead > free else 0 - free if ahead < 0 - free else ahead
    fed = (forward * reference >> 16) + (forward * ahead >> 16)
    fed += static if setpoint > 0 else 0 - static if setpoint < 0 else 0
    idle = n[_IDLE] + periods if speed == 0 else 0
    n[_IDLE] = idle
    summed, least, slow = error, n[_CREEPS], n[_EDGE] >> 2
    if idle > _PATIENCE and before > slow:
        summed = least if error < least else error
    elif idle > _PATIENCE and before < 0 - slow:
        summed = 0 - least if error > 0 - least else error
    soft, load = n[_SOFTNESS], n[_LOAD]
    integral = n[INTEGRAL] << sign >> sign
    wanted = (n[_P] * (error >> 1) >> 15 + soft) + (n[_I] * integral >> 16)
    most, least = load + (fed if fed > 0 else 0), (fed if fed < 0 else 0) - load
    effort = fed + wanted
    effort = most if effort > most else least if effort < least else effort
    effort = int(limit(numbers, effort, speed, forward * reference >> 16))
    cut, most = fed + wanted - effort, load - (load >> 3)
    n[_EXCESS] = cut if cut != 0 else wanted - most if wanted > most else wanted + most if wanted < 0 - most else 0
    if not ((summed > 0 and cut > 0) or (summed < 0 and cut < 0)):
        most = (load << 16) // n[_I]
        integral += (summed >> soft) * periods
        n[INTEGRAL] = most if integral > most else 0 - most if integral < 0 - most else integral
    return effort


@micropython.viper
def limit(numbers, effort: int, speed: int, held: int) -> int:
    """Return the effort within the torque limit around the back-EMF, which bounds the current, and MAX_EFFORT.

    The back-EMF is only what the encoder counts: it turns no effort round, and raises none above what the reference
    takes, `held`. What brakes shorts the motor at least, where its driver can.
    """
    n = ptr32(numbers)
    emf = n[_FORWARD] * speed >> 16
    brakes = (effort < 0 and speed > n[_FOLLOWS]) or (effort > 0 and speed < 0 - n[_FOLLOWS])  # which ends soon
    torque = n[_CONTINUOUS] if n[HEAT] >= n[_MAX_HEAT] and not brakes else n[_MAX_TORQUE]
    low, high = emf - torque, emf + torque
    if low > 0:
        low = -1 if effort < 0 else 0 if held <= 0 else low if low < held else held
    if high < 0:
        high = 1 if effort > 0 else 0 if held >= 0 else high if high > held else held
    most = n[_MAX_EFFORT]
    effort = low if effort < low else high if effort > high else effort
    return most if effort > most else 0 - most if effort < 0 - most else effort


@micropython.viper
def warm(numbers, effort: int, speed: int, periods: int):
    """Sum what a motor's current heats it more than its continuous one would, up to MAX_HEAT, where it is too much.

    That current is told as the effort that gives it at rest.
    """
    n = ptr32(numbers)
    emf = n[_GAIN] * speed >> 16
    if n[_FORWARD] == 0 and effort * emf > 0:
        emf = effort * emf // int(FULL_EFFORT)
    torque = effort - emf
    torque = (torque if torque > 0 else 0 - torque) >> 4
    kept, most = n[_CONTINUOUS] >> 4, n[_MAX_HEAT]
    heat = n[HEAT] + (torque * torque - kept * kept) * periods
    n[HEAT] = most if heat > most else heat if heat > 0 else 0


@micropython.viper
def is_doubted(numbers, fast: int, slow: int, held: int, ahead: int, periods: int) -> int:
    """Return whether a wheel that turns with `fast`, and shall stop, is only shorted: its encoder may be reversed.

    It may where it is not `held` and does not turn as it was driven; where it is held and fast, and is not known to
    follow its effort; and where it was seen to count against that. Who gets no slower by an eighth for half a second
    then rolls down a slope: a brake is tried. While each quarter of a second takes an eighth of the speed that goes on.
    Else it counts backward, or the slope is steep, and the next trial comes four seconds later: each may drive it on.
    One that is known to follow, and gets no slower by its brake, is not known any more: driven to and fro a reversed
    one seems to follow.
    """
    n = ptr32(numbers)
    doubted, rolls = 0, n[_ROLLS]
    patience = n[_SECOND] << 2 if n[_PROVED] == 3 else n[_SECOND] >> 1
    trial = (n[_SECOND] >> 2) + 1
    if n[_PROVED] >= 2 or (held and n[_PROVED] == 0 and not slow) or (not held and ahead <= 0):
        doubted = 1
    if fast == 0:
        if rolls > patience:
            doubted = 0
            n[_PROVED] = 0  # a hand may have stopped it
        rolls = 0
    elif doubted:
        if rolls == 0 or fast < n[_LEAST] - (n[_LEAST] >> 3):
            n[_LEAST] = fast
            rolls = patience if rolls > patience else 0
        waits = rolls <= patience
        rolls += periods
        if rolls > patience:
            n[_LEAST] = fast if waits else n[_LEAST]
            rolls = patience + 1 if waits else rolls
            doubted = 0
        if rolls > patience + trial:
            n[_LOOSE] = n[_SECOND] >> 1
    elif n[_PROVED] == 1:
        if slow or rolls == 0 or fast < n[_LEAST] - (n[_LEAST] >> 3):
            n[_LEAST] = fast
            rolls = 0
        rolls += periods
        if rolls > patience:
            n[_LOOSE] = patience
            n[_PROVED] = rolls = 0
    if n[_LOOSE]:
        if rolls > patience:
            n[_PROVED] = 3
        doubted = 1
        rolls = 0
    n[_ROLLS] = rolls
    return doubted


class Pid:
    """One wheel, by the `Numbers` of a configuration.

    The reference follows the set-point as the wheel is able to, and P and I act on the difference from it alone. So a
    step does not charge the integral, and the distance comes out exact, as long as the robot is driven.

    `fault` is what fault_watch found at the newest step. `n`: its array; where HEAT is the most only the continuous
    current is left.
    """

    def __init__(self, config, numbers):
        n = numbers
        blind, wrong, forget, second = in_periods(config, *TIMES, 1000)
        self.n = array("i", [n.follows, blind, wrong, n.reach, 1 << n.shift, forget] + [0] * (_STATIC - STILL) + [
            n.static, n.load, n.gain, n.forward, n.p, n.i, n.follow, n.lead, config.MAX_EFFORT, n.max_torque,
            n.continuous, n.max_heat, n.stiffness, n.free, n.creeps, second])
        self.reset(0)

    @micropython.viper
    def reset(self, periods: int):
        """Forget the past: no integral, no suspicion, motor off (and cooling) until it is driven again."""
        n = ptr32(self.n)
        for place in range(int(STILL), HEAT):
            n[place] = 0
        n[_HELD] = 1
        self.fault = NO_FAULT
        warm(self.n, 0, 0, periods)

    @micropython.viper
    def stop(self, counts: int, periods: int, holds: int, brake: int) -> int:
        """Return the effort that stops a wheel with `counts` edges in the past periods; if it `holds`, keeps it there.

        brake: the gain, or less.

        Never along the motion that is counted. Who `is_doubted` is only shorted.
        """
        numbers = self.n
        n, sign = ptr32(numbers), int(SIGN)
        earlier = n[_SPEED] << sign >> sign
        speed = int(measure(numbers, counts, periods))
        n[INTEGRAL] = n[REFERENCE] = n[MEAN] = n[_EXCESS] = 0
        fault = int(speed_fault(numbers, speed, periods))
        before = n[_EFFORT] << sign >> sign
        if fault == 0 and holds and before >= -1 and before <= 1:
            fault = int(rest_fault(numbers, speed, periods))
        self.fault = fault
        fast, edge = speed if speed > 0 else 0 - speed, n[_EDGE]
        slow, ahead = 1 if fast <= n[_CREEPS] else 0, speed * (n[_DIRECTION] << sign >> sign)
        if slow:
            n[_HELD] = 1
        held = n[_HELD] if holds else 0
        grown, left = speed - earlier if speed > 0 else earlier - speed, n[_LOOSE] - periods
        if grown > edge and not slow and ((before > 1 and speed < 0) or (before < -1 and speed > 0)):
            left = n[_SECOND] >> 1
        n[_LOOSE] = left if left > 0 else 0
        effort = -1 if speed > 0 else 1  # a driver that can brakes, whatever is counted; it turns nothing
        away, most = n[_AWAY] << sign >> sign, (n[_MAX_TORQUE] << 16) // n[_STIFFNESS]
        away = away + speed * periods if held else 0
        away = most if away > most else 0 - most if away < 0 - most else away
        if int(is_doubted(numbers, fast, slow, held, ahead, periods)):
            away = 0
        else:
            clear, most = fast - edge, 536870912 // (brake + 1)
            least = 0 if holds else fast if fast < edge else edge  # one edge of a wheel that is held may be a tremor
            clear = least if clear < least else most if clear > most else clear
            clear = clear if speed > 0 else 0 - clear
            wanted = 0 - (brake * clear >> 16) - (n[_STIFFNESS] * int(far_away(away, edge)) >> 16) >> n[_SOFTNESS]
            if (wanted > 0 and speed > 0) or (wanted < 0 and speed < 0):
                away -= away >> 2 if clear else 0  # it goes back: less is enough
            elif wanted != 0:
                effort = int(limit(numbers, wanted, speed, 0))
        n[_AWAY] = away
        n[_EFFORT] = effort
        warm(numbers, effort, speed, periods)
        return effort

    @micropython.viper
    def step(self, setpoint: int, counts: int, periods: int, bend: int) -> int:
        """Return the effort for the coming period, within +-MAX_EFFORT.

        setpoint: wanted speed, within the largest. counts: edges since the last call. periods: how many those
        took; more than one when the board missed ticks. bend: how much faster it is fed for what the robot
        accelerates beyond the reference [1/16 fine unit].
        """
        numbers = self.n
        n, sign = ptr32(numbers), int(SIGN)
        speed = int(measure(numbers, counts, periods))
        before, away, edge = n[_EFFORT] << sign >> sign, n[_AWAY] << sign >> sign, n[_EDGE]
        if n[_HELD]:  # what held it on a slope goes on, also where it was just shorted
            integral, most = 0 - n[_STIFFNESS] * int(far_away(away, edge)) // n[_I], (n[_LOAD] << 16) // n[_I]
            n[INTEGRAL] = most if integral > most else 0 - most if integral < 0 - most else integral
        mean = n[MEAN] << sign >> sign
        fault = int(speed_fault(numbers, speed, periods))
        if fault == 0:
            fault = int(drive_fault(numbers, mean, speed, before, n[_EXCESS] << sign >> sign, periods))
        self.fault = fault
        error, most = mean - speed, n[_FREE] >> 1
        error = most if error > most else 0 - most if error < 0 - most else error
        effort = int(follow_up(numbers, setpoint, speed, error, bend, periods))
        half, follows = (n[MEAN] << sign >> sign) >> 1, n[_FOLLOWS]
        if (half > 0 and speed < half - edge and effort < 0) or (half < 0 and speed > half + edge and effort > 0):
            effort = 0  # no braking turns it round
        if (effort > 0 and speed > follows) or (effort < 0 and speed < 0 - follows):
            n[_PROVED] = 1
        if n[int(WRONG)] > 3:
            n[_PROVED] = 2
        if setpoint != 0:
            n[_DIRECTION] = 1 if setpoint > 0 else -1
        n[_HELD] = n[_AWAY] = n[_ROLLS] = 0
        n[_EFFORT] = effort
        warm(numbers, effort, speed, periods)
        return effort
