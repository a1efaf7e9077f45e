"""Holds what a wheel counts against what it is driven with, by four rules; each finds what a healthy wheel does not do.

    NO_COUNTS  more is asked for it than seven eighths of what gravity and stiction may hold (MAX_LOAD) for 400 ms,
               in which it makes less than a quarter of the way that is wanted, and six edges of it or more are missing
    WRONG_WAY  driven one way, and counting the other way, for 450 ms: longer than a push
    TOO_MANY   more counts than the motor can make, for three periods
    NOISE      counts to and fro, nine turns or more and faster than four a second, while it stands without effort

Speeds are fine units (robot_numbers), times periods. All of the first two is in the direction of the drive.
`numbers` is a wheel's array, whose first places are theirs.
"""

from robotont_firmware.compat import SIGN, const, micropython, ptr32

# What is wrong with a wheel; the packets' status field carries these numbers.
NO_FAULT = const(0)
DRIVER_FAULT = const(1)  # the motor driver's fault line
NO_COUNTS = const(2)  # encoder unplugged or half dead, no motor current, or the wheel is blocked
WRONG_WAY = const(3)  # encoder or motor leads reversed, or the wheel is dragged
OVERLOAD = const(4)  # the motor has worked too hard for too long: its current is limited for now
TOO_MANY = const(5)  # another encoder or gear than configured, or noise
NOISE = const(6)  # encoder unplugged, or its cable picks up the motors

PART = const(4)  # of the way that is wanted, within
TIMES = (  # [ms]
    400,  # by the first rule: longer than a push on a slope that leaves a wheel little,
    450,  # and of the second;
    250,  # after which a turn of the fourth is forgotten
)
BEYOND = const(3)  # [periods] of the third
TURNS = const(8)  # of the fourth
_MOST_WAY = const(67108864)  # [fine units] no more is summed

_FOLLOWS = const(0)  # places in the numbers of a wheel: of the configuration,
_TIME = const(1)
_WRONG_TIME = const(2)
_REACH = const(3)
_EDGE = const(4)
_FORGET = const(5)
STILL = const(6)  # and of its past: [periods] of less than a quarter of the way,
WRONG = const(7)  # the wrong way,
_MANY = const(8)  # beyond the motor's reach;
_BEFORE = const(9)  # the speed of the period before,
_TURNED = const(10)  # [periods] that its turns are remembered;
_WANTED = const(11)  # the way [fine units] that is wanted,
_MADE = const(12)  # and that is made, and an edge: so it is never negative


@micropython.viper
def drive_fault(numbers, wished: int, speed: int, push: int, excess: int, periods: int) -> int:
    """Judge a period in which a wheel should make `wished` and made `speed`, with an effort `push`.

    excess: the effort that it asked for above MAX_LOAD, or its limits.
    """
    n = ptr32(numbers)
    if wished < 0:
        wished, speed = 0 - wished, 0 - speed
        push, excess = 0 - push, 0 - excess
    still, missing = n[STILL], 0
    judged = excess > 0 and wished > 0 and speed >= 0 - n[_FOLLOWS]
    if judged or still > 0:
        edge = n[_EDGE]
        wanted, made = n[_WANTED], n[_MADE] - edge if still > 0 else 0
        if judged:  # over edges: a slow wheel makes one now and then
            still, wanted, made = still + periods, wanted + wished * periods, made + speed * periods
        else:
            still -= periods
        made = made if made + edge > 0 else 0 - edge  # an edge back is a tremor, more are no way that is missing
        missing = wanted - PART * (made if made > 0 else 0)
        if missing <= 0:
            still = 0
        n[STILL] = still if still > 0 else 0
        n[_WANTED] = 0 if still <= 0 else wanted if wanted < _MOST_WAY else _MOST_WAY
        n[_MADE] = made + edge
    wrong = push >= 0 and wished > 0 and speed < 0 - n[_FOLLOWS]
    n[WRONG] = n[WRONG] + periods if wrong else 0
    if n[WRONG] > n[_WRONG_TIME]:
        return WRONG_WAY
    return NO_COUNTS if still > n[_TIME] and missing >= n[_EDGE] * 6 else NO_FAULT


@micropython.viper
def speed_fault(numbers, speed: int, periods: int) -> int:
    """Judge the speed of any period."""
    n = ptr32(numbers)
    many = speed > n[_REACH] or speed < 0 - n[_REACH]
    n[_MANY] = n[_MANY] + periods if many else 0
    return TOO_MANY if n[_MANY] >= BEYOND else NO_FAULT


@micropython.viper
def rest_fault(numbers, speed: int, periods: int) -> int:
    """Judge a period in which the wheel stood without effort."""
    n = ptr32(numbers)
    before = n[_BEFORE] << int(SIGN) >> int(SIGN)
    n[_BEFORE] = speed
    turned = (speed > 0 and before < 0 and speed - before >= n[_EDGE] * 3) or (
        speed < 0 and before > 0 and before - speed >= n[_EDGE] * 3)
    left = n[_TURNED] - periods
    n[_TURNED] = (left if left > 0 else 0) + (n[_FORGET] if turned else 0)
    return NOISE if n[_TURNED] > n[_FORGET] * TURNS else NO_FAULT
