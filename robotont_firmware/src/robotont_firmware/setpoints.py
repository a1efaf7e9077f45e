"""The set-points of all wheels: the newest command within the motors' reach, neared at MAX_ACCELERATION or MAX_BRAKING.

All wheels are scaled by one factor and move by one fraction of their way, which keeps the direction of travel.
"""

from array import array

from robotont_firmware.compat import SIGN, const, micropython, ptr16, ptr32

_REFERENCE = const(14)  # of wheel_speed


class Setpoints:
    """`now`: a speed for each wheel [fine units], on its way to `targets`. `bends`: see `accelerate`."""

    def __init__(self, wheels, numbers):
        self.targets = array("i", [0] * wheels)
        self.now = array("i", [0] * wheels)
        self._wheels = wheels
        self._max_speed = numbers.max_speed
        self._up = numbers.shift  # what makes fine units of 1/256 edge per period
        self._max_change, self._max_braking = numbers.change, numbers.braking
        self._change = self._max_change  # one of both, by the newest command
        self.bends = array("i", [0] * wheels)
        self._lead, self._turn_lead = numbers.lead, numbers.turn_lead
        self._follow, self._arc, self._drag, self._turns = numbers.follow, numbers.arc, numbers.drag, numbers.free >> 8

    @micropython.viper
    def take(self, wished) -> int:
        """Make a command [1/256 edge per period] the target, scaled to MAX_SPEED; return its fastest wheel."""
        sign = int(SIGN)
        wheels = int(self._wheels)
        most = int(self._max_speed)
        up = int(self._up)
        command = ptr32(wished)
        targets = ptr32(self.targets)
        fastest = 0
        for wheel in range(wheels):
            target = command[wheel] << sign >> sign
            target = target if target > 0 else 0 - target
            fastest = target if target > fastest else fastest
        for wheel in range(wheels):
            target = command[wheel] << sign >> sign
            if fastest > most << 8 >> up:
                # The factors lose bits, so that the product stays below 2^30.
                less = 0
                while fastest >> less > 32767:
                    less += 1
                target = ((target >> less) * (most >> 2) // (fastest >> less)) << 2
            else:
                target = (target << up) + 128 >> 8
            targets[wheel] = target
        self._change = self._max_braking if fastest == 0 else self._max_change
        return fastest

    @micropython.viper
    def advance(self) -> int:
        """Move all nearer to the targets; return the largest set-point, without sign."""
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
        fastest = 0
        less = 4 if most > 8191 else 0  # bits, so that the product stays below 2^30, as with slow periods
        for wheel in range(wheels):
            speed = now[wheel] << sign >> sign
            way = (targets[wheel] << sign >> sign) - speed
            speed += (way >> less) * most // (farthest >> less) if farthest > most else way
            now[wheel] = speed
            speed = speed if speed > 0 else 0 - speed
            fastest = speed if speed > fastest else fastest
        return fastest

    @micropython.viper
    def accelerate(self, pids):
        """Fill `bends`: how much faster each wheel is to be fed for what the robot accelerates beyond its reference.

        In 1/16 fine unit, in the direction of each wheel, for wheels at even angles: what they turn alike is the
        robot's turn, and an arc bends the way, across the motion, in which the neighbours of a wheel differ. What
        rubs while it turns is told as the acceleration that takes as much.
        """
        sign = int(SIGN)
        wheels = int(self._wheels)
        now = ptr32(self.now)
        bends = ptr32(self.bends)
        wished = turn = 0
        for wheel in range(wheels):
            turn += ptr32(pids[wheel].n)[_REFERENCE] << sign >> sign
            wished += now[wheel] << sign >> sign
        turning = (wished - turn) // wheels * int(self._follow) >> 8
        drag = int(self._drag)
        drag = drag if turn > int(self._turns) else 0 - drag if turn < 0 - int(self._turns) else 0
        lead, fed = int(self._lead), (turning + drag) * int(self._turn_lead)
        turn = turn // wheels >> 4
        arc, most = int(self._arc), int(self._max_change) * 2
        for wheel in range(wheels):
            before = ptr32(pids[wheel - 1].n)[_REFERENCE] << sign >> sign  # of its neighbours: -1 is the last
            behind = ptr32(pids[wheel + 1 - wheels].n)[_REFERENCE] << sign >> sign
            bend = (before - behind >> 4) * turn // arc
            bends[wheel] = ((most if bend > most else 0 - most if bend < 0 - most else bend) - turning) * lead + fed


@micropython.viper
def measure(totals, last_totals, counts, amount: int):
    """Fill counts with totals - last_totals modulo 2^16 (signed), and make the totals the last."""
    now, last = ptr16(totals), ptr16(last_totals)
    out = ptr32(counts)
    for index in range(amount):
        change = (now[index] - last[index]) & 0xFFFF
        out[index] = change - 0x10000 if change & 0x8000 else change
        last[index] = now[index]
