"""Poses that a board has integrated, `ODOM:x:y:yaw:vx:vy:turn`, back into counts of its wheels.

The board moves its pose once per period by `speed * 0.02 s`, turned by the yaw *before* the step, so the wheels' paths
can be recovered exactly, also over lost lines. Noise shows where a step is not the line's twist times the period.
"""

import math
import re
from typing import NamedTuple

from robotont_driver.protocol.board_wheels import PERIOD
from robotont_driver.protocol.packet import PacketError, WholeCounts
from robotont_driver.protocol.restarts import NEGLIGIBLE, Arrival, doubt_about, largest

_FLOAT = r"(-?(?:0|[1-9][0-9]{0,8})\.[0-9]{6})"  # what C's %f prints
_ODOM = re.compile("ODOM:" + ":".join([_FLOAT] * 6))
_NOT_FINITE = re.compile(r"ODOM:.*(nan|inf)", re.IGNORECASE)

PRINTED = 2e-6        # [m, rad] two roundings to six decimals, and as much again
SINGLE = 1.5e-7       # relative error of the board's single-precision pose
CONFIRMED = 3         # lines that must agree before a jump is believed; two did so by chance in 4 of a million
SMALLEST_EDGES = 1.0  # [edges per period] slower than this, the speed gives no estimate of the elapsed periods


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
    """Lines in, counts per period out; an inconsistent line is kept until the next ones confirm it.

    wheels: `BoardWheels`. reach: edges that a wheel can make in one period; usual: that the board lets it make.
    Counted: `repaired` periods, `restarts`, `doubts` (gaps in which the board may have restarted), and `inconsistent`
    lines that were dropped.
    """

    def __init__(self, wheels, reach, usual):
        self._wheels = wheels
        self._reach = reach
        self._usual = usual
        self.repaired = 0
        self.restarts = 0
        self.doubts = 0
        self.inconsistent = 0
        self._counts = WholeCounts(3)  # what the motors have made stays counted, whatever the board forgets
        self.forget()

    def forget(self):
        """Forget the board's pose."""
        self._last = None        # newest trusted line
        self._suspects = []      # lines that follow each other, but not it: noise, or lines were lost, or a restart
        self._arrival = None          # of `_last`
        self._suspected_at = 0.0      # [periods] when the first of `_suspects` came
        self._frames = (IN_BASE, IN_ODOM)  # in which the twist may be given; one, as soon as that is clear
        self._speed = [0.0] * 3  # [edges] of the newest period

    def restart(self, now):
        """The board reports a restart: its pose is the origin again."""
        self.restarts += self._last is not None
        self._begin(ORIGIN, now / PERIOD)

    def _begin(self, line, now):
        """Take a line as the first of a board that has restarted."""
        arrival = self._arrival
        self.forget()
        self._arrival = arrival
        self._take(line, now, 1)

    def _take(self, line, now, periods):
        """Trust a line, so many periods after the last one."""
        self._last, self._arrival = line, self._arrival.next(now, periods) if self._arrival else Arrival(now)

    def update(self, line, now):
        """List of `Packet`, one per period, that a `PoseLine` completes at `now` [s]. Raises PacketError."""
        now /= PERIOD
        if self._wheels.most_edges(line.vx * PERIOD, line.vy * PERIOD, line.turn * PERIOD) > self._reach:
            raise PacketError("reach", f"more than {self._reach} edges in one period")
        before = ORIGIN if self._last is None else self._last
        if self._fits(before, line):
            self._drop_suspects()
            return self._advance(before, line, now)
        if not (self._suspects and self._fits(self._suspects[-1], line)):
            self._drop_suspects()
            self._suspected_at = now
        self._suspects.append(line)
        return self._believe_suspects(now) if len(self._suspects) == CONFIRMED else []

    def _drop_suspects(self):
        self.inconsistent += len(self._suspects)
        self._suspects = []

    def _believe_suspects(self, now):
        lines, self._suspects = self._suspects, []
        packets = self._bridge(lines[0], self._suspected_at)
        for before, line in zip(lines, lines[1:]):
            packets += self._advance(before, line, now)
        return packets

    def _fits(self, before, line):
        """Whether the pose has moved from `before` to `line` by the twist of `line` in one period."""
        turned = abs(line.yaw - before.yaw - line.turn * PERIOD) <= tolerance(line.yaw)
        return turned and any(frame.fits(before, line) for frame in self._frames)

    def _advance(self, before, line, now):
        """One period from `before` to `line`."""
        fitting = tuple(frame for frame in self._frames if frame.fits(before, line))
        if len(fitting) == 1:
            self._frames = fitting
        self._take(line, now, 1)
        self._speed = self._wheels.edges(body_step(before, line, 1))
        return self._counts.share(self._speed)

    def _bridge(self, line, now):
        """From the last trusted line to one that the next ones have confirmed."""
        last = self._last
        if last is None:
            return []
        elapsed = now - self._arrival.at
        if self._fits(ORIGIN, line):
            self.restarts += 1
            self._begin(ORIGIN, now)
            return self._advance(ORIGIN, line, now)
        most = max(1, math.floor(self._arrival.most(now)))
        after = self._wheels.edges((*self._frames[0].path(line), line.turn * PERIOD))
        periods, edges = self._path(last, line, after, most)
        possible = largest(edges) <= self._usual * most
        doubt = None
        # a translation and a turn, each with wheels as fast as they can
        if self._wheels.most_edges(line.x, line.y, line.yaw) <= 2 * self._usual * most:
            anew, made = self._path(ORIGIN, line, after, most)
            difference = [one - other for one, other in zip(edges, made)]
            if possible and largest(difference) > NEGLIGIBLE:
                before = [edge - newest for edge, newest in zip(edges, after)]
                doubt = doubt_about(before, periods - 1, elapsed, self._speed, after)
            if not possible or (doubt and largest(made) < doubt.unexplained):
                self.restarts += 1
                self._begin(ORIGIN, now)
                return self._repair(line, anew, made, possible, now)
        elif not possible:
            self.restarts += 1
            self._begin(line, now)
            return []
        return self._repair(line, periods, edges, doubt is not None, now)

    def _path(self, before, line, after, most):
        """(periods, edges) of the way from a line to another, whose own period made the edges `after`."""
        edges = self._wheels.edges(body_step(before, line, 1))
        pace = max((abs(old) + abs(new)) / 2 for old, new in zip(self._speed, after))
        periods = max(1, min(round(max(map(abs, edges)) / max(pace, SMALLEST_EDGES)), most))
        return periods, self._wheels.edges(body_step(before, line, periods))

    def _repair(self, line, periods, edges, doubt, now):
        """Packets for the lines that were lost and the one that came."""
        self.repaired += periods - 1
        self.doubts += doubt
        self._take(line, now, periods)
        return self._counts.share(edges, periods)


def tolerance(value):
    """How far [m, rad] a coordinate may be from where it should be."""
    return PRINTED + SINGLE * abs(value)


class _Frame:
    """The frame in which a board gives the linear velocity of its twist."""

    def __init__(self, turned):
        self._turned = turned

    def path(self, line):
        """Displacement (forward, left) [m] in base_link by the velocity in one period."""
        vx, vy = line.vx * PERIOD, line.vy * PERIOD
        return (vx, vy) if self._turned else rotate(vx, vy, -line.yaw)

    def fits(self, before, line):
        """Whether x and y have moved from `before` to `line` by the velocity."""
        dx, dy = line.vx * PERIOD, line.vy * PERIOD
        if self._turned:
            dx, dy = rotate(dx, dy, before.yaw)
        return abs(line.x - before.x - dx) <= tolerance(line.x) and abs(line.y - before.y - dy) <= tolerance(line.y)


IN_BASE = _Frame(turned=True)   # from firmware 2.1.3 on
IN_ODOM = _Frame(turned=False)  # up to firmware 2.1.2


def body_step(before, line, periods):
    """(forward [m], left [m], turn [rad]) in base_link, the sum of equal steps that the board has made in `periods`.

    The board turns each step by the yaw before it, so n equal steps with a turn d in all add up to the step turned by
    d (n - 1) / 2n and shortened by sin(d / 2) / (n sin(d / 2n)). For one period nothing of that remains.
    """
    turn = line.yaw - before.yaw
    dx, dy = rotate(line.x - before.x, line.y - before.y, -before.yaw - turn * (periods - 1) / (2 * periods))
    if periods > 1 and 0 < abs(turn) < math.pi:
        longer = periods * math.sin(turn / (2 * periods)) / math.sin(turn / 2)
        dx, dy = longer * dx, longer * dy
    return dx, dy, turn


def rotate(x, y, angle):
    """(x, y) turned by an angle [rad]."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y
