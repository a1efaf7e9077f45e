"""The set-points of all wheels: the newest command within the motors' reach, neared at MAX_ACCELERATION or MAX_BRAKING.

All wheels are scaled by one factor and move by one fraction of their way, which keeps the direction of travel.
"""

from array import array

from robotont_firmware import gain_bounds as bounds
from robotont_firmware.compat import SIGN, const, micropython, ptr16, ptr32

_TURNS = const(192)  # [1/256 unit] the wheels of a robot that turns, summed, turn faster


class Setpoints:
    """`now`: a number for each wheel [1/256 unit], on its way to `targets`. `straight`, `turning`: see `accelerate`."""

    def __init__(self, wheels, config):
        self.targets = array("i", [0] * wheels)
        self.now = array("i", [0] * wheels)
        self._wheels = wheels
        self._max_speed = config.MAX_SPEED * 256
        self._max_change = bounds.acceleration(config, config.MAX_ACCELERATION)
        self._max_braking = bounds.acceleration(config, config.MAX_BRAKING)
        self._change = self._max_change  # one of both, by the newest command
        self.straight = array("i", [0] * wheels)
        self.turning = 0
        self._references = array("i", [0] * wheels)
        self._follow = config.FOLLOW
        self._arc = config.ARC
        self._drag = config.TURN_DRAG

    @micropython.viper
    def take(self, wished) -> int:
        """Make a command [1/256 unit] the target, scaled to MAX_SPEED; return its fastest wheel."""
        sign = int(SIGN)
        wheels = int(self._wheels)
        most = int(self._max_speed)
        command = ptr32(wished)
        targets = ptr32(self.targets)
        fastest = 0
        for wheel in range(wheels):
            target = command[wheel] << sign >> sign
            target = target if target > 0 else 0 - target
            fastest = target if target > fastest else fastest
        for wheel in range(wheels):
            target = command[wheel] << sign >> sign
            if fastest > most:
                # Both factors lose 4 bits, so that the product stays below 2^30.
                target = target * (most >> 4) // (fastest >> 4)
            targets[wheel] = target
        self._change = self._max_braking if fastest == 0 else self._max_change
        return fastest

    @micropython.viper
    def advance(self) -> int:
        """Move all nearer to the targets; return how far the farthest was from its own."""
        sign = int(SIGN)
        wheels = int(self._wheels)
        most = int(self._change)
        targets = ptr32(self.targets)
        now = ptr32(self.now)
        farthest = 0
        for wheel in range(wheels):
            way = (targets[wheel] << sign >> sign) - (now[wheel] << sign >> sign)
            way = way if way > 0 else 0 - way
            farthest = way if way > farthest else farthest
        if farthest > 0:
            for wheel in range(wheels):
                before = now[wheel] << sign >> sign
                way = (targets[wheel] << sign >> sign) - before
                if farthest > most:
                    way = way * most // farthest
                now[wheel] = before + way
        return farthest

    @micropython.viper
    def fastest(self) -> int:
        """Return the largest set-point, without sign."""
        sign = int(SIGN)
        now = ptr32(self.now)
        most = 0
        for wheel in range(int(self._wheels)):
            speed = now[wheel] << sign >> sign
            speed = speed if speed > 0 else 0 - speed
            most = speed if speed > most else most
        return most

    @micropython.viper
    def accelerate(self, pids):
        """Note by what share the robot turns faster, and by what else each wheel accelerates: an arc bends the way.

        All in 1/256 unit per period, in the direction of each wheel, for wheels at even angles: what they turn alike
        is the robot's turn, and the bend is across the motion, in which the neighbours of a wheel differ. What rubs
        while it turns is told as the acceleration that takes as much.
        """
        sign = int(SIGN)
        wheels = int(self._wheels)
        now = ptr32(self.now)
        references = ptr32(self._references)
        straight = ptr32(self.straight)
        wished = turn = 0
        for wheel in range(wheels):
            reference = int(pids[wheel].reference)
            references[wheel] = reference
            turn += reference
            wished += now[wheel] << sign >> sign
        turning = (wished - turn) // wheels * int(self._follow) >> 8
        drag = int(self._drag)
        self.turning = turning + (drag if turn > _TURNS else 0 - drag if turn < 0 - _TURNS else 0)
        turn = turn // wheels >> 4
        arc = int(self._arc)
        for wheel in range(wheels):
            before = references[wheel - 1 if wheel > 0 else wheels - 1] << sign >> sign
            across = before - (references[wheel + 1 if wheel < wheels - 1 else 0] << sign >> sign)
            straight[wheel] = (across >> 4) * turn // arc - turning


@micropython.viper
def clear(numbers, amount: int):
    """Make numbers[0:amount] (32 bits each) zero."""
    there = ptr32(numbers)
    for index in range(amount):
        there[index] = 0


@micropython.viper
def differences(totals, last_totals, counts, amount: int):
    """Fill counts with totals - last_totals modulo 2^16 (signed), and make the totals the last ones."""
    now = ptr16(totals)
    last = ptr16(last_totals)
    out = ptr32(counts)
    for index in range(amount):
        change = (now[index] - last[index]) & 0xFFFF
        out[index] = change - 0x10000 if change & 0x8000 else change
        last[index] = now[index]
