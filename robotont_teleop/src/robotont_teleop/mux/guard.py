"""How fast a hand may drive towards what the sensors show now; free of ROS and clock. Nothing is remembered.

Places are x + iy [m] in the frame of the track that the robot's commands make: what was shown stays where it was while
the robot moves on. Times [s] are the caller's; twists are (v_x [m/s], v_y [m/s], omega [rad/s]).
"""

import cmath
import math

import numpy as np

from robotont_driver.command.limits import Limits, limit_acceleration, limit_speed
from robotont_driver.kinematics.se2 import arc, compose
from robotont_teleop.hand.speeds import STOP
from robotont_teleop.mux.sensor_view import look

SIDE = 0.025       # [m] kept free around the footprint, and around what a sensor is too near to measure ...
REST = 0.055       # [m] ... and, on top of it, in the direction of travel
GRAZE = 0.005      # [m] by which it may get nearer to what is nearer than SIDE already
REACTION = 0.1     # [s] until the wheels follow a command
SLOWEST = 0.02     # [m/s] below it the robot stands
DECELERATION = 1.5  # [m/s^2] where the driver has no limit of its own
ZEROS = Limits(linear_acceleration=3.2)  # [m/s^2] of the wheels by zeros, which no limit of the driver holds back
READINGS = 7       # the newest of each sensor count, for as many of its periods: one may show what another misses ...
SHORTEST, LONGEST = 0.3, 2.0  # [s] ... but at least and at most for so long
TRACK = 300        # steps of the newest seconds: a reading may be a second old, and commands come 50 times per second
SECTORS, WINDOW = 36, 2  # all around; those on both sides of the way that have to be seen
SIDES = ("ahead", "on the left", "behind", "on the right")


class Guard:
    """Scales twists, never bends them, so that the robot can stop before the points that its sensors show.

    body: (radius, floor, top) as in `look`. limits: the driver's `Limits`; wheel_speeds: twist -> [m/s]. blind_speed:
    [m/s] where no sensor sees. `see` and `refuse` may be called by other threads than the rest: nobody waits.
    """

    def __init__(self, body, limits, wheel_speeds, blind_speed):
        self._body, self._limits, self._wheel_speeds, self._blind_speed = body, limits, wheel_speeds, blind_speed
        given = filter(None, (limits.linear_acceleration, limits.linear_deceleration))
        self._braking = min(given, default=DECELERATION)
        self._sensors = {}  # (rays that have measured, newest readings, [s] for which they count) by name
        self._news, self._view = True, ()  # whether a reading has come, and all of them in one
        self._refused = {}  # (why, time) by name
        self._sent = self._moving = STOP
        self._track = ((0.0, 0.0, 0.0, 0.0),)  # (time, *pose)
        self.held = None  # (time, words) of the newest command that was slowed because of something in the way

    def see(self, sensor, place, angles, ranges, bounds, at):
        """A reading as `look` takes it, of a sensor by name. Raises ValueError."""
        able, readings, _ = self._sensors.get(sensor, (None, (), 0.0))
        able = able if np.shape(able) == np.shape(ranges) else np.zeros(len(ranges), bool)
        points, rays, reach, able = look(place, angles, ranges, bounds, able, self._body)
        times, *poses = zip(*self._track)
        x, y, yaw = (np.interp(at, times, column) for column in poses)
        sectors = np.floor((np.angle(rays) + yaw) * SECTORS / (2 * math.pi)).astype(int) % SECTORS
        reach = np.bincount(sectors, reach, SECTORS) / np.maximum(np.bincount(sectors, minlength=SECTORS), 1)
        ring = SIDE + max(self._body[0] + REST, math.hypot(*place[1][:2]) + bounds[0])  # [m] away it stops
        reading = at, complex(x, y), complex(x, y) + points * cmath.exp(1j * yaw), np.full(len(points), ring), reach
        readings = [*(one for one in readings if at - one[0] < LONGEST), reading][-READINGS:]
        lasts = READINGS * (at - readings[0][0]) / max(len(readings) - 1, 1)
        recent = {name: one for name, one in self._sensors.items() if at - one[1][-1][0] < LONGEST}
        self._sensors = {**recent, sensor: (able, readings, len(readings) > 1 and min(max(SHORTEST, lasts), LONGEST))}
        self._news = True

    def _together(self, here, now):
        """(until when it counts, place, points, rings, reach): in each degree from here the nearest point of all."""
        until = max((readings[-1][0] + lasts for _, readings, lasts in self._sensors.values()), default=now)
        fresh = [one for _, readings, lasts in self._sensors.values() for one in readings if now - one[0] < lasts]
        points, rings = (np.concatenate([np.zeros(0), *(one[part] for one in fresh)]) for part in (2, 3))
        degrees = np.floor(np.degrees(np.angle(points - here)))
        order = np.argsort(degrees + abs(points - here) / 100)  # below half a degree, as nothing is farther than REACH
        order = order[np.diff(degrees[order], prepend=-360.0) > 0.0]
        reach = np.max([np.zeros(SECTORS), *(one[4] - abs(here - one[1]) for one in fresh)], axis=0)
        return until, here, points[order], rings[order], reach

    def refuse(self, sensor, why, now):
        """A reading has come that cannot be used."""
        recent = {name: one for name, one in self._refused.items() if now - one[1] < LONGEST}
        self._refused = {**recent, sensor: (why, now)}

    def sent(self, twist, now):
        """Whoever has commanded it: this goes out from now on."""
        self.move(now)
        self._sent = limit_speed(twist, self._wheel_speeds(twist), self._limits)

    def move(self, now):
        """The robot has moved as commanded; to be called often."""
        begin, *pose = self._track[-1]
        lasts, before = max(0.0, now - begin), self._moving
        self._moving = limit_acceleration(before, self._sent, lasts, self._limits if any(self._sent) else ZEROS)
        step = arc(tuple((old + new) / 2 * lasts for old, new in zip(before, self._moving)))
        self._track = (*self._track[-TRACK:], (now, *compose(pose, step)))
        if self._news:
            self._news = False  # before: a reading that comes meanwhile is news
            self._view = self._together(complex(*self._track[-1][1:3]), now)

    def limit(self, twist, now):
        """The twist, or a slower one in the same direction."""
        speed = math.hypot(*twist[:2])
        if not speed or not (self._sensors or self._refused):
            return twist
        self.move(now)
        _, x, y, yaw = self._track[-1]
        pace, (until, _, points, rings, _) = math.hypot(*self._moving[:2]), self._view
        bearing, bend = math.atan2(twist[1], twist[0]), twist[2] / 2 * (speed / self._braking + REACTION)
        bend = max(-math.pi, min(bend, math.pi))
        allowed = min(speed, max(self._blind_speed, self._stopping(self._seen(bearing, bearing + bend, now))))
        points, fastest = points - complex(x, y), max(speed, pace)
        near = abs(points) - rings < (fastest * (fastest / self._braking / 2 + REACTION) if now < until else -math.inf)
        if near.any():
            points, rings = points[near] * cmath.exp(-1j * yaw), rings[near]
            free, nearest = self._free_way(twist, points, rings)
            stopping = self._stopping(free)
            if pace and self._free_way(self._moving, points, 0.0)[0] < pace * (pace / self._braking + REACTION) / 2:
                stopping = 0.0  # it moves in another direction, and zeros brake harder than any change of direction
            if stopping < allowed:
                allowed = stopping if stopping > SLOWEST else 0.0
                gap, side = abs(nearest) - self._body[0], SIDES[round(cmath.phase(nearest) * 2 / math.pi) % 4]
                self.held = now, f"in the way: something {side}, {max(0.0, gap):.2f} m from the robot"
        return twist if allowed == speed else tuple(part * allowed / speed for part in twist)

    def report(self, now):
        """(whether all is well, what it knows, in words)."""
        self.move(now)
        wrong = [f"{name} cannot be used: {why}" for name, (why, at) in self._refused.items() if now - at < LONGEST]
        if wrong or not (self._sensors or self._refused):
            return not wrong, "; ".join(wrong) or "no scan and no range: does not interfere"
        seen = [self._seen(quarter * math.pi / 2, quarter * math.pi / 2, now) for quarter in range(4)]
        where = ", ".join(side for side, way in zip(SIDES, seen) if way <= 0.0)
        words = f"at most {self._blind_speed:.2f} m/s where no sensor sees: {where}"
        return True, words if where else "sees all around"

    def _stopping(self, way):
        """[m/s] from which the robot stops within a way [m]."""
        return self._braking * (math.sqrt(REACTION ** 2 + 2 * max(0.0, way) / self._braking) - REACTION)

    def _seen(self, bearing, end, now):
        """[m] around the footprint that are seen, from one angle [rad] to another and around them."""
        (until, place, _, _, reach), (_, x, y, yaw) = self._view, self._track[-1]
        first, last = sorted(math.floor((angle + yaw) * SECTORS / (2 * math.pi)) for angle in (bearing, end))
        way = range(first - WINDOW, last + WINDOW + 1)
        seen = min(reach[sector % SECTORS] for sector in way) - abs(complex(x, y) - place) - self._body[0]
        return seen if now < until else 0.0

    def _free_way(self, twist, points, rings):
        """([m] along the arc of the twist until a point on the way comes into its ring, that point), in base_link."""
        # beside what is nearer than SIDE already it may go on, and a little nearer, but not again and again
        closest, radius, speed = abs(points).min(), self._body[0], math.hypot(*twist[:2])
        width = min(max(closest - GRAZE, min(closest - GRAZE / 10, radius + SIDE / 2)), radius + SIDE)
        ahead = points * complex(twist[0] / speed, -twist[1] / speed)  # as if it drove along x ...
        ahead = ahead.conj() if twist[2] < 0.0 else ahead  # ... and to the left; straight is a circle, too
        bend = 1.0 / max(abs(twist[2]) / speed, 1e-3)
        spokes = ahead * 1j + bend  # from the circle's middle, with the robot on the real axis
        enters, meets = ((bend ** 2 + abs(spokes) ** 2 - ring ** 2) / np.maximum(2 * bend * abs(spokes), 1e-9)
                         for ring in (np.maximum(rings, width), width))  # cosines of the turn from there to the point
        turns = np.angle(spokes) % (2 * math.pi) - np.arccos(np.clip(enters, -1.0, 1.0))
        ways = np.where(meets > 1.0, math.inf, np.maximum(turns, 0.0) * bend)
        first = np.lexsort((abs(points), ways))[0]
        return float(ways[first]), complex(points[first])
