"""Poses that a board has integrated, `ODOM:x:y:yaw:vx:vy:turn`, back into the steps of its body.

Once per period the board moves its pose by its twist times 0.02 s, turned by the yaw *before* the step. So a line that
follows another one is proved by it, and lost lines lose no distance: the pose has them.
"""

import math
import re
from typing import NamedTuple

from robotont_driver.kinematics.se2 import sinc
from robotont_driver.protocol.lost_packets import ANY, NEGLIGIBLE, Arrival, doubt_about, largest
from robotont_driver.protocol.packet import PacketError

PERIOD = 0.02         # [s] between two lines
PRINTED = 2e-6        # [m, rad] two roundings to six decimals, and as much again
SINGLE = 1.5e-7       # relative error of the board's single-precision pose
CONFIRMED = 3         # lines that must agree before a jump is believed; two did so by chance in 4 of a million
SPREAD = 0.2          # part of what is owed that a packet has: speeds stay even
SMALLEST_EDGES = 1.0  # [edges per period] slower than this, the speed gives no estimate of the elapsed periods

_FLOAT = r"(-?(?:0|[1-9][0-9]{0,8})\.[0-9]{6})"  # what C's %f prints
_ODOM = re.compile("ODOM:" + ":".join([_FLOAT] * 6))
_NOT_FINITE = re.compile(r"ODOM:.*(nan|inf)", re.IGNORECASE)


class PoseLine(NamedTuple):
    """One line of feedback. The twist is that of the newest period, in base_link or in the odometry frame."""

    x: float     # [m]
    y: float     # [m]
    yaw: float   # [rad] not wrapped
    vx: float    # [m/s]
    vy: float    # [m/s]
    turn: float  # [rad/s]


ORIGIN = PoseLine(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def parse_pose(text):
    """`PoseLine` of a line without its end. Raises PacketError."""
    match = _ODOM.fullmatch(text)
    if match:
        return PoseLine(*map(float, match.groups()))
    if _NOT_FINITE.match(text):
        raise PacketError("not finite", f"a number that is not finite, in {text[:60]!r}")
    if text.count(":") != 6:
        raise PacketError("fields", "{} fields instead of 6 in {!r}".format(text.count(":"), text[:60]))
    raise PacketError("number", f"not six numbers as the board prints them, in {text[:60]!r}")


class PoseTracker:
    """Lines in, wheel paths per period out; a line that does not follow is kept until the next ones confirm it.

    wheels: `BoardWheels`. usual: [edges] that the board lets a wheel make in a period. length(line, elapsed): by what
    the board's period was longer than it says, where a line came `elapsed` [periods] after the one before; None for
    lost lines. Counted: `repaired` periods, `restarts`, `doubts` (gaps in which the board may have restarted),
    `inconsistent` lines that were dropped, `strange`: lines in a row that moved against their own twist.
    """

    def __init__(self, wheels, usual, length):
        self._wheels = wheels
        self._usual = usual
        self._length = length
        self.repaired = self.restarts = self.doubts = self.inconsistent = self.strange = 0
        self._last = self._arrival = None  # newest trusted line, and its `Arrival`
        self._suspects = []      # (line, now) that follow each other, but not it: noise, losses, or a restart
        self._speed = [0.0] * 3  # [edges] of the newest period
        self._owed = [0.0] * 3   # [edges] made in what a period was longer, which the next packets have as well

    def restart(self, now):
        """The board reports that it starts: its pose is the origin."""
        self._begin(ORIGIN, now / PERIOD)

    def _begin(self, line, now):
        """Take a line as the newest of a board that has started."""
        self.restarts += self._last is not None
        self._suspects, self._speed = [], [0.0] * 3
        self._take(line, now, 1)

    def _take(self, line, now, periods):
        """Trust a line, so many periods after the last one; [periods] that have passed since then by the clock."""
        before, self._last = self._arrival, line
        self._arrival = before.next(now, periods) if before else Arrival(now)
        return now - before.at if before else float(periods)

    def update(self, line, now):
        """List of edges (3 floats each), one per period, that a `PoseLine` completes at `now` [s]."""
        now /= PERIOD
        before = self._last or ORIGIN
        if follows(before, line):
            self._drop_suspects()
            self.strange = 0
            return [self._step(before, line, now)]
        if not (self._suspects and follows(self._suspects[-1][0], line)):
            self._drop_suspects()
            self.strange += 1
        self._suspects.append((line, now))
        if len(self._suspects) < CONFIRMED:
            return []
        lines, self._suspects = self._suspects, []
        edges = self._bridge(*lines[0], self._wheels.edges(body_step(lines[0][0], lines[1][0])))
        if edges is None:
            self.inconsistent += len(lines)
            return []
        return edges + [self._step(one, other, at) for (one, _), (other, at) in zip(lines, lines[1:])]

    def _drop_suspects(self):
        self.inconsistent += len(self._suspects)
        self._suspects = []

    def _step(self, before, line, now):
        """Edges of the one period from `before` to `line`."""
        self._speed = self._wheels.edges(body_step(before, line))
        length = self._length(line, self._take(line, now, 1))
        part = SPREAD if any(self._speed) else 1.0
        more = [owed + edges * (length - 1) for owed, edges in zip(self._owed, self._speed)]
        self._owed = [edges * (1 - part) for edges in more]
        return [edges + owed * part for edges, owed in zip(self._speed, more)]

    def _bridge(self, line, now, after):
        """Edges per period from the last trusted line to one that the next ones have confirmed; None: it is too old.

        after: [edges] of the period behind it.
        """
        last = self._last
        if last is None or follows(ORIGIN, line):
            self._begin(line if last is None else ORIGIN, now)
            return [] if last is None else [self._step(ORIGIN, line, now)]
        elapsed, most = now - self._arrival.at, max(1, math.floor(self._arrival.most(now)))
        edges, anew = (self._wheels.edges(body_step(start, line)) for start in (last, ORIGIN))
        possible = largest(edges) <= self._usual * most
        # a translation and a turn, each with wheels as fast as they can
        may_be_new = self._wheels.most_edges(line.x, line.y, line.yaw) <= 2 * self._usual * most
        if not possible and not may_be_new:
            if elapsed < ANY:
                return None
            self._begin(line, now)
            return []
        doubt = None
        if possible and may_be_new and largest([one - other for one, other in zip(edges, anew)]) > NEGLIGIBLE:
            lost = [edge - newest for edge, newest in zip(edges, after)]
            doubt = doubt_about(lost, self._periods(edges, after, most) - 1, elapsed, self._speed, after)
        self.doubts += doubt is not None
        if not possible or (doubt and largest(anew) < doubt.unexplained):
            self._begin(ORIGIN, now)
            edges = anew
        periods = self._periods(edges, after, most)
        self.repaired += periods - 1
        length = self._length(None, self._take(line, now, periods))
        return [[edge * length / periods for edge in edges]] * periods

    def _periods(self, edges, after, most):
        """For how many periods such a way takes, the last one with the edges `after`."""
        pace = max((abs(old) + abs(new)) / 2 for old, new in zip(self._speed, after))
        return max(1, min(round(largest(edges) / max(pace, SMALLEST_EDGES)), most))


def follows(before, line):
    """Whether the pose has moved from `before` to `line` by its twist, in either frame, in one period."""
    def near(value, other):
        return abs(value - other) <= PRINTED + SINGLE * abs(value)
    moves = (line.vx * PERIOD, line.vy * PERIOD), rotate(line.vx * PERIOD, line.vy * PERIOD, before.yaw)
    return near(line.yaw, before.yaw + line.turn * PERIOD) and any(
        near(line.x, before.x + dx) and near(line.y, before.y + dy) for dx, dy in moves)


def body_step(before, line):
    """(forward [m], left [m], turn [rad]) in base_link that the wheels have made between two lines.

    The board turns each step by the yaw before it, so n equal steps with a turn d in all add up to the step turned by
    d (n - 1) / 2n, where d / n is the line's own turn, and shortened by sin(d / 2) / (d / 2), but for the n-th part.
    """
    turn = line.yaw - before.yaw
    longer = 1 / sinc(turn / 2) if abs(turn) < math.pi else 1.0
    dx, dy = rotate(line.x - before.x, line.y - before.y, -before.yaw - (turn - line.turn * PERIOD) / 2)
    return longer * dx, longer * dy, turn


def rotate(x, y, angle):
    """(x, y) turned by an angle [rad]."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y
