"""Holds what a wheel counts against what it is driven with: bounds its effort, and finds broken encoders and wheels.

All is for one wheel, in the direction in which it is driven ("ahead"). A motor with a certain effort turns a free
wheel at a certain speed, and a healthy wheel needs at most MAX_LOAD more than that. So while the robot moves as it
should, a wheel gets at most MAX_LOAD above what turns a free wheel as fast as it counts (or, when that is more, what
turns a free wheel at 1.15 times its set-point). A wheel that stays at this bound is blocked, or has more load than
the profile allows, or its encoder loses edges, or counts what is none: without a second sensor these are one. Counts
are smoothed, so that noise does not pass for motion; and time at the bound is not forgotten, but worked off by edges.

An encoder that loses edges by chance, or over a part of the turn, counts unevenly, where the speed of a healthy wheel
changes little from period to period. So what the second difference of its counts has above 2.5 edges and a part of
the speed is summed while the robot moves as it should, and worked off by even counts. Not of a wheel that should
stand: an edge to and fro for ever, as where it rests on the border of one, is as uneven as the counts of a broken one.

Beside fast wheels, which load it sideways, a wheel may be driven by what turns a free one at three eighths of the
fastest set-point. While the robot changes its motion other wheels may hold or drag one: then only a wheel that makes
less than a quarter of its speed is bounded, and for longer.
"""

from array import array

from robotont_firmware import gain_bounds as bounds
from robotont_firmware.compat import const, micropython, ptr32

# What is wrong with a wheel; the packets' status field carries these numbers.
NO_FAULT = const(0)
DRIVER_FAULT = const(1)  # the motor driver's fault line
NO_COUNTS = const(2)  # driven, and the encoder shows too little motion: unplugged, no motor current, or blocked
WRONG_WAY = const(3)  # driven, and the encoder counts against it: encoder or motor leads reversed
OVERLOAD = const(4)  # the motor has worked too hard for too long: its current is limited for now
TOO_MANY = const(5)  # the encoder counts more than the motor can make: not the configuration's, or noise

_RISE = const(640)  # [1/256 unit] a wheel that is faster than a little ago by more than this follows;
_CLEAR_RISE = const(2048)  # [1/256 unit] by this while the robot moves as it should: more than noise
_EVEN = const(640)  # [1/256 unit] what the second difference of a healthy wheel's counts may have,
_FAST = const(16384)  # [1/256 unit] and to which speed a part of it is added,
_KNOCK = const(1024)  # [1/256 unit] and the most beyond it that one period adds: a knock is no broken encoder
_SETTLED = const(5)  # weights of a period in which the robot moves as it should,
_CHANGING = const(3)  # and of one in which it changes its motion

# Places in the numbers of a wheel: of the configuration,
_GAIN = const(0)  # [1/256 effort] that a free wheel needs per unit
_STATIC = const(1)  # [effort]
_LOAD = const(2)  # [effort] that a healthy wheel may need above a free one
_TIME = const(3)  # [periods/5]
_SETTLED_SHARE = const(4)  # [1/256]
_CHANGING_SHARE = const(5)  # [1/256]
_BESIDE = const(6)  # [1/256]
_WRONG = const(7)  # [1/256 edge]
_UNEVEN_SHARE = const(8)  # [1/256]
_UNEVEN_EDGES = const(9)  # [1/256 edge]
# and of its past. Machine code reads them without sign: those that may be negative have _ZERO added.
_DIRECTION = const(10)  # in which it was driven last: -1, 0, 1
_COUNTED = const(11)  # [1/256 unit] ahead, smoothed over four periods
_MOST = const(12)  # [effort] ahead, while it is bounded
_BOUNDED = const(13)  # 0 or 1
_BLIND = const(14)  # [periods/5] at the bound
_OWED = const(15)  # [1/256 edge] that it should have made meanwhile and did not
_UNEVEN = const(16)  # [1/256 edge] by which its counts were more uneven than a healthy wheel's
_AHEAD = const(17)  # [1/256 edge] that it did make; negative: the wrong way
_LACK = const(18)  # [1/256 unit] by which it missed its aim in the last period,
_STEP = const(19)  # [1/256 unit] and by how much more than in the one before
_PLACES = const(20)
_ZERO = const(0x8000000)


class FaultWatch:
    """One wheel. gain: effort that a free wheel needs per unit [1/256], 0 where that does not depend on the speed.

    The numbers stand in an array, and machine code reads them there: as attributes they took a tenth of the period.
    """

    def __init__(self, config, gain):
        battery = config.BATTERY
        self.numbers = array("i", [0] * _PLACES)
        self.numbers[_GAIN] = gain
        self.numbers[_STATIC] = bounds.at_battery(config.STATIC, battery)
        self.numbers[_LOAD] = bounds.at_battery(config.MAX_LOAD, battery)
        self.numbers[_TIME] = config.BLIND_TIME * _SETTLED
        self.numbers[_SETTLED_SHARE], self.numbers[_CHANGING_SHARE] = config.BLIND_SHARE, config.CHANGING_SHARE
        self.numbers[_BESIDE] = config.BESIDE_SHARE
        self.numbers[_WRONG] = config.WRONG_EDGES * 256
        self.numbers[_UNEVEN_SHARE], self.numbers[_UNEVEN_EDGES] = config.UNEVEN_SHARE, config.UNEVEN_EDGES * 256

    @micropython.viper
    def direction(self) -> int:
        """Return in which direction the wheel was driven last: -1, 0 or 1."""
        return ptr32(self.numbers)[_DIRECTION] - _ZERO

    @micropython.viper
    def reset(self):
        """Forget the past."""
        n = ptr32(self.numbers)
        for place in range(_MOST, _AHEAD):
            n[place] = 0
        n[_DIRECTION] = n[_COUNTED] = n[_AHEAD] = n[_LACK] = n[_STEP] = _ZERO

    @micropython.viper
    def bound(self, effort: int) -> int:
        """Return the effort within what the wheel may have now: backward, no more than holds it against MAX_LOAD."""
        n = ptr32(self.numbers)
        direction = n[_DIRECTION] - _ZERO
        ahead = effort * direction
        least = 0 - n[_STATIC] - n[_LOAD]
        if n[_BOUNDED] and ahead > n[_MOST]:
            return n[_MOST] * direction
        if n[_BOUNDED] and ahead < least:
            return least * direction
        return effort

    @micropython.viper
    def look(self, setpoint: int, wished: int, ahead: int, push: int, limited: int, periods: int, settled: int,
             fastest: int) -> int:  # fmt: skip
        """Judge the past period, in which the wheel was to make `wished` and made `ahead`; return what is wrong.

        push: the effort that it had. limited: whether anything limited that. Speeds in 1/256 unit; see Pid.step.
        """
        n = ptr32(self.numbers)
        direction = n[_DIRECTION] - _ZERO
        counted = n[_COUNTED] - _ZERO
        if setpoint * direction < 0 or (setpoint != 0 and direction == 0):
            direction = 1 if setpoint > 0 else -1
            n[_DIRECTION] = direction + _ZERO
            counted = 0 - counted
        wished *= direction
        ahead *= direction
        push *= direction
        setpoint *= direction
        rising = ahead > counted + (_CLEAR_RISE if settled else _RISE)
        counted += (ahead - counted) * (periods if periods < 4 else 4) >> 2
        n[_COUNTED] = counted + _ZERO
        slow = counted * 256 < wished * (n[_SETTLED_SHARE] if settled else n[_CHANGING_SHARE])
        n[_BOUNDED] = 1 if settled or (slow and not rising) else 0

        if self._is_uneven(wished - ahead, counted, settled if setpoint != 0 else 0):
            return NO_COUNTS

        believed = ahead if ahead < counted else counted
        free = n[_STATIC] + ((n[_GAIN] * believed >> 16) if believed > 0 else 0)
        most = n[_STATIC] + (n[_GAIN] * (setpoint * 294 >> 8) >> 16)  # 1.15 times
        beside = (fastest - setpoint) * n[_BESIDE] >> 8
        laden = free + n[_LOAD] + ((n[_GAIN] * beside >> 16) if beside > 0 else 0)
        most = laden if laden > most else most
        n[_MOST] = most

        missing = wished - counted
        fault = NO_FAULT
        at_most = push >= most - (most >> 3) or (slow and limited)
        works = push > 0 and (counted < 0 or push - free > n[_LOAD] >> 1)
        if n[_BOUNDED] and at_most and missing > 0 and works and not rising:
            fault = NO_COUNTS
        if settled and missing < 0 and push * 8 < (n[_STATIC] + n[_LOAD]) * -7:
            fault = WRONG_WAY
            missing = 0 - missing
        if fault == NO_FAULT:
            if n[_BLIND] > 0:
                owed = n[_OWED] - (counted * 2 * periods if counted > 0 else 0)
                n[_OWED] = owed if owed > 0 else 0
                if owed <= 0:
                    n[_BLIND] = 0
                    n[_AHEAD] = _ZERO
            return NO_FAULT

        enough = n[_WRONG] if n[_WRONG] > fastest * 2 else fastest * 2  # [1/256 edge] two periods of the fastest
        owed = n[_OWED] + missing * periods
        n[_OWED] = owed if owed < enough else enough
        turned = n[_AHEAD] - _ZERO + ahead * periods
        n[_AHEAD] = _ZERO + (enough if turned > enough else 0 - enough if turned < 0 - enough else turned)
        n[_BLIND] += periods * (_SETTLED if settled else _CHANGING)
        if n[_BLIND] < n[_TIME] or n[_OWED] < enough:
            return NO_FAULT
        return WRONG_WAY if turned <= 0 - n[_WRONG] else fault

    @micropython.viper
    def _is_uneven(self, lack: int, counted: int, settled: int) -> int:
        """Sum by how much its counts, of which it lacks `lack`, bend more than a healthy wheel's; 1: too much."""
        n = ptr32(self.numbers)
        step = lack - (n[_LACK] - _ZERO)
        bend = step - (n[_STEP] - _ZERO)
        n[_LACK] = lack + _ZERO
        n[_STEP] = step + _ZERO
        bend = (bend if bend > 0 else 0 - bend) if settled else 0
        fast = counted if counted < _FAST else _FAST
        bend -= _EVEN + ((fast if fast > 0 else 0) * n[_UNEVEN_SHARE] >> 8)
        uneven = n[_UNEVEN] + (bend if bend < _KNOCK else _KNOCK)
        n[_UNEVEN] = uneven if uneven > 0 else 0
        return 1 if uneven >= n[_UNEVEN_EDGES] else 0
