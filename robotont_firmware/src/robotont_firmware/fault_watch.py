"""Holds what a wheel counts against what it is driven with, by four rules; each finds what a healthy wheel does not do.

    NO_COUNTS  driven with half of what a load may need for 300 ms, in which it makes less than a quarter of the way
               that is wanted, and at least six edges of that are missing
    WRONG_WAY  driven one way, and counting the other way, for 450 ms: longer than a push
    TOO_MANY   more counts than the motor can make, for three control periods
    NOISE      counts to and fro, nine turns within a second or two, while it stands without effort

Speeds are fine units (robot_numbers), times control periods. All of the first two is in the direction of the drive.
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

TIME = 300  # [ms] of the first rule, and half as much again of the second
BEYOND = const(3)  # [control periods] of the third
TURNS = const(8)  # of the fourth,
FORGET = 250  # [ms] after which one is forgotten
_LONGEST = const(4096)  # [control periods] no more are counted

_STATIC = const(0)  # places in the numbers of a wheel: of the configuration,
_LOAD = const(1)
_FOLLOWS = const(2)
_TIME = const(3)
_REACH = const(4)
_EDGES = const(5)
_FORGET = const(6)
STILL = const(7)  # and of its past: [periods] of less than a quarter of the way,
_WRONG = const(8)  # the wrong way,
_MANY = const(9)  # beyond the motor's reach;
_BEFORE = const(10)  # the speed of the period before,
_TURNED = const(11)  # [periods] that its turns are remembered;
_WAY = const(12)  # [fine units] a quarter of which is missing
WATCHED = const(13)  # places


def watched(config, numbers):
    """Return the first numbers of a wheel's array, for the `Numbers` of its configuration."""
    return [numbers.static, numbers.load, numbers.follows, numbers.periods(config, TIME), numbers.reach,
            3 << numbers.shift, numbers.periods(config, FORGET)] + [0] * (WATCHED - STILL)  # fmt: skip


@micropython.viper
def drive_fault(numbers, wished: int, speed: int, push: int, periods: int) -> int:
    """Judge a control period in which a wheel should make `wished` and made `speed`, with an effort `push`."""
    n = ptr32(numbers)
    if wished < 0:
        wished, speed, push = 0 - wished, 0 - speed, 0 - push
    works = push - n[_STATIC] > n[_LOAD] >> 1
    judged = works and wished > 0 and speed >= 0 - n[_FOLLOWS]
    way = n[_WAY] + ((wished - speed * 4) * periods if judged else 0)  # over edges: a slow wheel makes one now and then
    still = n[STILL] + (periods if judged else 0 - periods)
    still = still if still < _LONGEST else _LONGEST
    most = wished * still  # no more is missing than was wanted: an edge back is a tremor
    lags = way > 0 and still > 0 and most > 0
    n[STILL] = still if lags else 0
    n[_WAY] = 0 if not lags else way if way < most else most
    wrong = push >= 0 and wished > 0 and speed < 0 - n[_FOLLOWS]
    n[_WRONG] = n[_WRONG] + periods if wrong else 0
    if n[_WRONG] * 2 > n[_TIME] * 3:
        return 3
    return 2 if n[STILL] > n[_TIME] and n[_WAY] >= n[_EDGES] * 2 else 0


@micropython.viper
def speed_fault(numbers, speed: int, periods: int) -> int:
    """Judge the speed of any control period."""
    n = ptr32(numbers)
    many = speed > n[_REACH] or speed < 0 - n[_REACH]
    n[_MANY] = n[_MANY] + periods if many else 0
    return 5 if n[_MANY] >= BEYOND else 0


@micropython.viper
def rest_fault(numbers, speed: int, periods: int) -> int:
    """Judge a control period in which the wheel stood without effort."""
    n = ptr32(numbers)
    before = n[_BEFORE] << int(SIGN) >> int(SIGN)
    n[_BEFORE] = speed
    turned = (speed > 0 and before < 0 and speed - before >= n[_EDGES]) or (
        speed < 0 and before > 0 and before - speed >= n[_EDGES])
    left = n[_TURNED] - periods
    n[_TURNED] = (left if left > 0 else 0) + (n[_FORGET] if turned else 0)
    return 6 if n[_TURNED] > n[_FORGET] * TURNS else 0
