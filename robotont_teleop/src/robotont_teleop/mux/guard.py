"""How fast a hand may drive towards what the sensors show; free of ROS and clock.

Points are complex numbers, x + iy [m], in the frame of the track that the robot's commands make: they stay where they
were while it moves on. Times [s] are the caller's; twists are (v_x [m/s], v_y [m/s], omega [rad/s]).
"""

import math
from typing import NamedTuple

import numpy as np

from robotont_driver.command.limits import limit_acceleration
from robotont_driver.kinematics.se2 import arc, compose
from robotont_teleop.hand.speeds import STOP

SIDE = 0.025       # [m] kept free around the footprint ...
REST = 0.055       # [m] ... and, on top of it, in the direction of travel
REACTION = 0.1     # [s] until the wheels follow a command
SLOWEST = 0.02     # [m/s] below it the robot stands
DECELERATION = 1.5  # [m/s^2] where the driver has no limit of its own
BRAKING = 3.2      # [m/s^2] of the wheels by zeros, which no limit holds back
STALE = 0.3        # [s] after its newest reading a sensor sees nothing any more ...
FORGOTTEN = 10.0   # [s] of driving ... what it has seen counts; [s] for what has left the view of one that sees
BEYOND = 0.05      # [m] what a range sensor shows may reach out of its cone: half the gap to the next of twelve ...
BESIDE_A_CONE = 3.0  # [s] ... and counts there
REACH = 2.0        # [m] farther things do not count
OWN = 0.8          # of the footprint's radius: what is nearer is the robot itself
BESIDE = 0.5       # [m] what has left the sensor's view counts within
DOUBT = 0.1        # [m] by which a point near the sensor may be off
SURE = 0.25        # [rad] around what it remembers a sensor need not see what is nearer than it measures
SECTORS = 36       # all around; one is seen where any ray lies in it
WINDOW = 2         # sectors on both sides of the way that have to be seen
SIDES = ("ahead", "on the left", "behind", "on the right")


class Seen(NamedTuple):
    """What a sensor has shown: when, the points, and the sectors it looks at as bits."""

    at: float
    driven: float  # [s] that the robot had driven by then
    points: np.ndarray
    times: np.ndarray  # of the points
    sectors: int


class Guard:
    """Scales twists, never bends them, so that the robot can stop before the points that its sensors have shown.

    radius: [m] of the round footprint. limits: the driver's `Limits`. blind_speed: [m/s] where no sensor sees.
    `see` may be called by other threads than the rest: nobody waits for anybody.
    """

    def __init__(self, radius, limits, blind_speed):
        self._radius, self._limits, self._blind_speed = radius, limits, blind_speed
        given = filter(None, (limits.linear_acceleration, limits.linear_deceleration))
        self._braking = min(given, default=DECELERATION)
        self._sensors = {}
        self._sent = STOP
        self._driven = 0.0
        self._track = ((0.0, STOP, STOP),)  # (time, pose, twist) of the newest steps
        self.held = None   # (time, words) of the newest command that was slowed because of something in the way
        self.blind = ""    # words, once a command was slowed because no sensor sees where it leads

    def see(self, sensor, place, angles, ranges, nearest, at, beyond=0.0):
        """Readings of a sensor at `place` (x, y, yaw) in base_link, made at the time `at`.

        ranges: [m] in the directions `angles` [rad], evenly from right to left, by REP 117: inf nothing, -inf too near,
        NaN no reading. What comes nearer than it can measure (`nearest`), or out of its view, is remembered.
        beyond: [m] by which what a cone shows may reach out of it.
        """
        pose = self._pose(at)
        x, y, yaw = compose(pose, place)
        sensor_at = complex(x, y)
        too_near = ranges == -math.inf
        unknown = np.isnan(ranges) | (ranges < nearest)
        step = max(float(angles[-1] - angles[0]) / max(1, len(angles) - 1), 1e-3)
        kept, times, index = self._remembered(sensor, sensor_at, yaw, (angles[0], step), nearest, unknown, at)
        hidden = too_near.copy()  # nothing is remembered there
        around = round(2 * math.pi / step)  # rays
        covered = (index[:, None] + np.arange(-round(SURE / step), round(SURE / step) + 1)) % around
        hidden[covered[covered < len(ranges)]] = False
        distances = np.where(unknown, math.inf, ranges)
        if hidden.any():
            old, known = self._sensors.get(sensor), np.where(unknown, math.nan, ranges)
            known[index] = abs(kept[:len(index)] - sensor_at)
            # into a narrow view things come from beside, however near
            looked = old and at - old.at < STALE and len(ranges) >= around
            distances[hidden] = np.maximum(self._radius - math.hypot(*place[:2]),
                                           _uncovered(known, hidden, nearest) if looked else 0.0)
        counts = distances < REACH
        rays = np.exp(1j * (angles + yaw))
        points = sensor_at + distances[counts] * rays[counts]
        points = points[hidden[counts] | (abs(points - complex(*pose[:2])) > OWN * self._radius)]
        edges = points[:0]
        if beyond and len(points):
            edges = points[[0, -1]] + rays[[0, -1]] * (-1j * beyond, 1j * beyond)
        sectors = np.floor((angles + place[2])[~np.isnan(ranges)] * SECTORS / (2 * math.pi)).astype(int) % SECTORS
        bits = sum(1 << sector for sector in set(sectors.tolist()))
        times = np.concatenate([np.full(len(points), at), np.full(len(edges), at - FORGOTTEN + BESIDE_A_CONE), times])
        self._sensors[sensor] = Seen(at, self._driven, np.concatenate([points, edges, kept]), times, bits)

    def _remembered(self, sensor, sensor_at, yaw, rays, nearest, unknown, at):
        """Of the old points those of which the sensor tells nothing now, one per direction; their times; their rays."""
        old = self._sensors.get(sensor)
        points, times = (old.points, old.times) if old else (np.zeros(0, complex), np.zeros(0))
        local = (points - sensor_at) * np.exp(-1j * yaw)
        order = np.argsort(abs(local))
        points, times, local = points[order], times[order], local[order]
        first, step = rays
        index = ((np.angle(local) - first + step / 2) % (2 * math.pi) / step).astype(int)
        index %= round(2 * math.pi / step)
        ray = np.minimum(index, len(unknown) - 1)
        too_near = (ray == index) & unknown[ray] & (abs(local) < nearest + DOUBT)
        times = np.where(too_near, at, times)
        index, first = np.unique(np.where(too_near | (ray != index) & (abs(local) < BESIDE) & (at - times < FORGOTTEN),
                                          index, -1), return_index=True)
        return points[first][index >= 0], times[first][index >= 0], index[(index >= 0) & (index < len(unknown))]

    def sent(self, twist, now):
        """Whoever has commanded it: this goes out from now on."""
        self._move(now)
        if twist == STOP != self._sent:
            _, pose, moving = self._track[-1]
            lasts = math.hypot(*moving[:2]) / BRAKING
            self._track = (*self._track[:-1], (now, pose, tuple(part / 2 for part in moving)))
            self._track = (*self._track, (now + lasts, self._pose(now + lasts), STOP))
        self._sent = twist

    def limit(self, twist, now):
        """The twist, or a slower one in the same direction."""
        speed = math.hypot(twist[0], twist[1])
        if not speed or not self._sensors:
            return twist
        allowed = speed
        seen = [one for one in tuple(self._sensors.values()) if self._driven - one.driven < FORGOTTEN]
        if self._blind_speed < speed and not self._sees(twist, speed, seen, now):
            allowed = self._blind_speed
            self.blind = f"no sensor sees where the hand drives: {allowed:.2f} m/s"
        if any(len(one.points) for one in seen):
            self._move(now)
            _, pose, moving = self._track[-1]
            points = (np.concatenate([one.points for one in seen]) - complex(*pose[:2])) * np.exp(-1j * pose[2])
            way, nearest = self._free_way(twist, speed, points)
            free = max(0.0, way - REST)
            stopping = self._braking * (math.sqrt(REACTION ** 2 + 2 * free / self._braking) - REACTION)
            pace = math.hypot(moving[0], moving[1])  # in another direction, maybe
            if pace and self._free_way(moving, pace, points)[0] < pace * (pace / self._braking + REACTION) / 2:
                stopping = 0.0  # zeros brake harder than any change of direction
            if stopping < allowed:
                allowed = stopping if stopping > SLOWEST else 0.0
                gap = abs(nearest) - self._radius
                side = SIDES[round(math.atan2(nearest.imag, nearest.real) * 2 / math.pi) % 4]
                self.held = now, (f"in the way: something {side}, " + (
                    f"{gap:.2f} m from the robot" if gap > 1e-6 else "too near to measure"))
        return twist if allowed == speed else tuple(part * allowed / speed for part in twist)

    def report(self, now):
        """What it knows, in words."""
        if not self._sensors:
            return "no scan and no range whose place is known: does not interfere"
        bits = self._bits(self._sensors.values(), now)
        blind = [not bits >> sector & 1 for sector in range(SECTORS)]
        edges = [sector * 360 // SECTORS for sector in range(SECTORS) if blind[sector] != blind[sector - 1]]
        if not edges:
            return f"no fresh scan or range: at most {self._blind_speed:.2f} m/s" if blind[0] else "sees all around"
        edges = edges[1:] + edges[:1] if blind[0] and blind[-1] else edges
        where = ", ".join(f"{begin} to {end}" for begin, end in zip(edges[::2], edges[1::2]))
        return f"at most {self._blind_speed:.2f} m/s where no sensor sees, in degrees from ahead to the left: {where}"

    @staticmethod
    def _bits(sensors, now):
        bits = 0
        for seen in tuple(sensors):
            bits |= seen.sectors if now - seen.at < STALE else 0
        return bits

    def _sees(self, twist, speed, seen, now):
        """Whether fresh readings cover the way until the robot could stand."""
        bearing = math.atan2(twist[1], twist[0])
        bend = twist[2] / 2 * (speed / self._braking + REACTION)
        first, last = (math.floor(angle * SECTORS / (2 * math.pi) + side * WINDOW) for angle, side in
                       ((bearing + min(0.0, bend), -1), (bearing + max(0.0, bend), 1)))
        bits = self._bits(seen, now)
        return all(bits >> sector % SECTORS & 1 for sector in range(first, min(last, first + SECTORS - 1) + 1))

    def _free_way(self, twist, speed, points):
        """([m] along the arc of the twist until the footprint meets a point, that point), all in base_link."""
        # beside what is nearer than SIDE already it may go on, and a little nearer, but not again and again
        closest = abs(points).min()
        radius = min(max(closest - 0.005, min(closest - 0.0005, self._radius + SIDE / 2)), self._radius + SIDE)
        ahead = points * complex(twist[0] / speed, -twist[1] / speed)  # as if it drove along x ...
        if twist[2] < 0.0:
            ahead = ahead.conj()  # ... and to the left; straight is a circle, too
        bend = 1.0 / max(abs(twist[2]) / speed, 1e-3)
        spokes = ahead * 1j + bend  # from the circle's middle, with the robot on the real axis
        distances = abs(spokes)
        cosine = (bend ** 2 + distances ** 2 - radius ** 2) / np.maximum(2 * bend * distances, 1e-9)
        turns = np.angle(spokes) % (2 * math.pi) - np.arccos(np.clip(cosine, -1.0, 1.0))
        ways = np.where(cosine > 1.0, math.inf, np.maximum(turns, 0.0) * bend)
        first = int(np.argmin(ways))
        return min(float(ways[first]), REACH - radius), complex(points[first])

    def _pose(self, at):
        """Where the robot was or will be by its commands."""
        begin, pose, twist = next((step for step in reversed(self._track) if step[0] <= at), self._track[0])
        return compose(pose, arc(tuple(part * (at - begin) for part in twist))) if twist != STOP else pose

    def _move(self, now):
        begin, _, before = self._track[-1]
        if self._sent == STOP and now < begin:
            return  # it still brakes
        twist = STOP
        if self._sent != STOP:
            twist = limit_acceleration(before, self._sent, max(0.0, now - begin), self._limits)
            self._driven += max(0.0, now - begin)
        self._track = (*self._track[-100:], (now, self._pose(now), twist))


def _uncovered(known, hidden, nearest):
    """[m] of the `hidden` rays of a scan all around, nearer than measured (`nearest`), not so in the scan before.

    known: [m] of each ray by measurement or memory, or NaN. What comes out from behind something is no nearer than
    that; what has just come was farther than `nearest` a scan ago.
    """
    sure = np.flatnonzero(~np.isnan(known))
    if not len(sure):
        return 0.0
    after = np.searchsorted(sure, np.flatnonzero(hidden))
    beside = np.minimum(known[sure[after - 1]], known[sure[after % len(sure)]])
    return np.where(beside < nearest, beside, nearest - DOUBT)
