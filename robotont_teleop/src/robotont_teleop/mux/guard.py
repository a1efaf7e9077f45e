"""How fast a hand may drive towards what the sensors show now; free of ROS and clock. Nothing is remembered.

Places are x + iy [m] in a frame that stays, or in base_link; times [s]; twists (v_x [m/s], v_y [m/s], omega [rad/s]).
"""

import math
import threading

import numpy as np

from robotont_driver.command.command_stream import LARGEST
from robotont_driver.kinematics.se2 import arc, compose
from robotont_teleop.hand.sensor_view import look

SIDE = 0.025       # [m] kept free around the footprint, and around what a sensor is too near to measure ...
REST = 0.055       # [m] ... and, on top of it, in the direction of travel
GRAZE = 0.005      # [m] by which it may get nearer to what is nearer than SIDE already
REACTION, PERIODS = 0.1, 2  # [s] until the wheels follow a command, and in periods of the board, at least
READINGS = 7       # of its periods for which a reading counts: one may show what another misses, or another part ...
SHORTEST, LONGEST = 0.3, 2.0  # [s] ... but at least and at most for so long
STEP = 0.005       # [s] of the steps of the odometry that are kept, at least: a reading may be LONGEST old
SECTORS, WINDOW = 36, 2  # all around; those on both sides of the way that have to be seen
SIDES = ("ahead", "on the left", "behind", "on the right")


class Guard:
    """Scales twists, never bends them, so that the robot can stop before the points that its sensors show.

    body: (radius, floor, top) [m] of the robot: what ends within is the robot, what ends lower or higher lets it pass.
    braking: [m/s^2]. blind_speed: [m/s] where no sensor sees. Readings may come in several threads.
    """

    def __init__(self, body, braking, blind_speed):
        self._body, self._braking, self._blind_speed, self._reaction = body, braking, blind_speed, REACTION
        self._moving, self._track = (0.0, 0.0, 0.0), ((0.0, 0.0, 0.0, 0.0),)  # as it moves; (time, *pose) of late
        self._lock, self._readings = threading.Lock(), []
        self._times, self._able, self._refused = {}, {}, {}  # by the sensors' names
        self._view = *np.zeros((5, 0)), np.zeros((0, SECTORS))  # all readings in one
        self.held = None  # (time, words) of the newest command that was slowed because of something in the way

    def moves(self, twist, now):
        """The robot's own motion, by its odometry. What no robot can do is none: no place would be right any more."""
        if not all(abs(part) <= LARGEST for part in twist):
            return
        begin, *pose = self._track[-1]
        step = compose(pose, arc(np.multiply(twist, min(now - begin, SHORTEST))))
        kept = self._track if now - self._track[-2:][0][0] > STEP else self._track[:-1]
        self._moving, self._track = twist, (*kept[-round(LONGEST / STEP):], (now, *step))

    def see(self, sensor, place, angles, ranges, bounds, at):
        """A reading of a sensor by name, as `look` takes it. Raises ValueError."""
        able = self._able.get((sensor, len(angles)), False)
        points, rays, reach, self._able[sensor, len(angles)] = look(place, angles, ranges, bounds, able, self._body)
        times, *poses = zip(*self._track)
        if abs(at - times[-1]) > LONGEST:
            raise ValueError(f"no odometry within {LONGEST:.0f} s of its stamps")
        x, y, yaw = (np.interp(at, times, column) for column in poses)
        sectors = np.floor((np.angle(rays) + yaw) * SECTORS / (2 * math.pi)).astype(int) % SECTORS
        reach = np.bincount(sectors, reach, SECTORS) / np.maximum(np.bincount(sectors, minlength=SECTORS), 1)
        ring = SIDE + max(self._body[0] + REST, math.hypot(*place[1][:2]) + bounds[0])  # [m] away it stops
        past = [time for time in self._times.get(sensor, ())[-READINGS:] if at - time < LONGEST]
        # one that is late counts from when it came
        ends = max(at, times[-1]) + (min(max(SHORTEST, READINGS * (at - past[0]) / len(past)), LONGEST) if past else 0)
        self._times[sensor] = (*past, at)
        each = np.full((len(points), 2), (ends, ring)).T
        reading = x + 1j * y + points * np.exp(1j * yaw), *each, [ends], [x + 1j * y], [reach]
        with self._lock:
            self._readings = [*(earlier for earlier in self._readings if earlier[3][0] > times[-1]), reading]
            self._view = [np.concatenate(column) for column in zip(*self._readings)]

    def limit(self, twist, now):
        """The twist, or a slower one in the same direction."""
        speed, pace = math.hypot(*twist[:2]), math.hypot(*self._moving[:2])
        if not speed or not self._has_sensor():
            return twist
        bend = max(-math.pi, min(twist[2] / 2 * (speed / self._braking + self._reaction), math.pi))
        seen = self._seen(math.atan2(twist[1], twist[0]), bend, now)
        allowed = slow = min(speed, max(self._blind_speed, self._stopping(seen)))
        free, point = self._free_way(twist, 1.0, now)
        moving, before = self._free_way(self._moving, 0.0, now) if pace else (math.inf, point)
        if moving < pace * (pace / self._braking + self._reaction) / 2:
            free, point = 0.0, before  # it moves elsewhere, and zeros brake harder than any change of direction
        if self._stopping(free) < slow:
            allowed, side = self._stopping(free), SIDES[round(np.angle(point) * 2 / math.pi) % 4]
            self.held = now, f"in the way: something {side}, {max(0, abs(point) - self._body[0]):.2f} m from the robot"
        return twist if allowed == speed else tuple(part * allowed / speed for part in twist)

    def report(self, now):
        """(whether all is well, what it knows, in words)."""
        wrong = [f"{one} cannot be used: {why}" for one, (at, why) in list(self._refused.items()) if now - at < LONGEST]
        if wrong or not self._has_sensor():
            return not wrong, "; ".join(wrong) or "no scan and no range: does not interfere"
        if self._seen(0.0, 2 * math.pi, now) > 0.0:
            return True, "sees all around"
        dark = ", ".join(side for turn, side in enumerate(SIDES) if self._seen(turn * math.pi / 2, 0.0, now) <= 0.0)
        return True, f"by hand at most {self._blind_speed:.2f} m/s where no sensor sees: {dark or 'in some directions'}"

    def _has_sensor(self):
        return bool(self._readings or self._refused)

    def _stopping(self, way):
        """[m/s] from which the robot stops within a way [m]."""
        return self._braking * (math.sqrt(self._reaction ** 2 + 2 * max(0.0, way) / self._braking) - self._reaction)

    def _seen(self, bearing, bend, now):
        """[m] around the footprint that are seen on both sides of an angle [rad], and from there by a bend [rad]."""
        (*_, ends, origins, reaches), (_, x, y, yaw) = self._view, self._track[-1]
        first, last = sorted(math.floor((turn + yaw) * SECTORS / (2 * math.pi)) for turn in (bearing, bearing + bend))
        reaches = reaches[:, np.arange(first - WINDOW, last + WINDOW + 1) % SECTORS]
        far = reaches[ends > now] - abs(origins - complex(x, y))[ends > now, None]
        return far.max(axis=0, initial=0.0).min() - self._body[0]

    def _free_way(self, twist, share, now):
        """([m] along the arc of the twist until a point on the way comes into a share of its ring, that point)."""
        (points, ends, rings, *_), (_, x, y, yaw) = self._view, self._track[-1]
        radius, speed, points = self._body[0], math.hypot(*twist[:2]), points - complex(x, y)
        near = (abs(points) - rings < speed * (speed / self._braking / 2 + self._reaction)) & (ends > now)
        if not near.any():
            return math.inf, 0.0
        points, rings = points[near] * np.exp(-1j * yaw), share * rings[near]
        # beside what is nearer than SIDE already it may go on, and a little nearer, but not again and again
        closest, side = abs(points).min(), math.copysign(1.0, twist[2])
        width = min(max(closest - GRAZE, min(closest - GRAZE / 10, radius + SIDE / 2)), radius + SIDE)
        bend = 1.0 / max(abs(twist[2]) / speed, 1e-3)  # radius of the circle on which it drives: straight is one, too
        # what its sensor is too near to measure may be nearer than it shows: no small circle leads away from that
        bend = np.where(abs(points) < rings * (rings > SIDE + radius + REST), np.maximum(bend, rings), bend)
        spokes = bend + 1j * side * points / (complex(*twist[:2]) / speed)  # from its middle, with the robot at `bend`
        enters, meets = ((bend ** 2 + abs(spokes) ** 2 - ring ** 2) / np.maximum(2 * bend * abs(spokes), 1e-9)
                         for ring in (np.maximum(rings, width), width))  # cosines of the turn from there to the point
        turns = side * np.angle(spokes) % (2 * math.pi) - np.arccos(np.clip((enters, meets), -1.0, 1.0))
        chord = np.sqrt(np.maximum(rings ** 2 - width ** 2, 0.0))  # who bends away first comes into a ring for nothing
        ways = np.where(meets > 1.0, math.inf, np.maximum(0.0, np.maximum(turns[0] * bend, turns[1] * bend - chord)))
        first = np.lexsort((abs(points), ways))[0]
        return float(ways[first]), complex(points[first])
