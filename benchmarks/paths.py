"""Paths to drive, and how far a robot was off one."""

import math

import numpy as np

from robotont_testing.simulated_wheels import PERIOD, path_of

REST = (0.0, 0.0, 0.0)
LEAD_IN, TAIL = 25, 50     # [periods] of rest before and after
WINDOW = 75                # [periods] by which truth may be late
BEYOND = 1.0               # [m] that the ends of a path go on straight
RAMP = 0.8                 # [m/s^2] with which the paths that do not jump begin and end
RADIUS, WAVE, EIGHT, SIDE = 0.5, 2.0, 6.0, 1.0  # [m] circle's radius, slalom's and eight's length, square's side


def circle(speed, way):
    """Round once, and once the other way round on the spot meanwhile."""
    turn = speed / RADIUS
    return speed * math.cos(2 * way / RADIUS), speed * math.sin(2 * way / RADIUS), -turn


def eight(speed, way):
    """A figure of eight whose curvature has no jump, driven forwards."""
    return speed, 0.0, speed * 2.405 * 2 * math.pi / EIGHT * math.sin(2 * math.pi * way / EIGHT)


def slalom(speed, way):
    """Waves, without turning."""
    angle = 0.8 * math.sin(2 * math.pi * way / WAVE)
    return speed * math.cos(angle), speed * math.sin(angle), 0.0


def square(speed, way):
    """Without turning: its corners are jumps."""
    angle = math.pi / 2 * min(3, int(way / SIDE))
    return speed * math.cos(angle), speed * math.sin(angle), 0.0


PATHS = {circle: 2 * math.pi * RADIUS, eight: EIGHT, slalom: 2 * WAVE, square: 4 * SIDE}


def commands(path, length, speed):
    """Twists of a path, one per period; all but the square begin and end with RAMP."""
    way, now, found = 0.0, 0.0, [REST] * LEAD_IN
    while way < length:
        rest = max(length - way, 0.0)
        now = speed if path is square else min(speed, now + RAMP * PERIOD, math.sqrt(2 * RAMP * rest) + 0.002)
        found.append(path(now, way + now * PERIOD / 2))
        way += now * PERIOD
    return found + [REST] * TAIL


def deviation(twists, poses):
    """(across the path [m], heading [rad]) by which each true pose is off the path of `twists`."""
    path = seen_from(poses[0], path_of(twists))
    moving = np.flatnonzero(np.any(np.array(twists), axis=1))
    first, last = path[moving[0]], path[moving[-1] + 1]
    start, end = heading_of(path[moving[0]:]), heading_of(path[moving[-1] + 1::-1])
    path = np.vstack([[*(first[:2] - BEYOND * start), first[2]], path[moving[0]:moving[-1] + 2],
                      [*(last[:2] - BEYOND * end), last[2]]])
    across, heading = [], []
    for number, (x, y, yaw) in enumerate(poses[moving[0]:]):
        near = path[max(0, number - WINDOW):number + WINDOW]
        off, place = nearest((x, y), near)
        across.append(off)
        heading.append(math.remainder(yaw - place, 2 * math.pi))
    return np.array(across), np.abs(heading)


def seen_from(pose, path):
    """Poses of a path that begins at the origin, begun at `pose`."""
    x, y, yaw = pose
    sin, cos = math.sin(yaw), math.cos(yaw)
    return np.column_stack([x + cos * path[:, 0] - sin * path[:, 1], y + sin * path[:, 0] + cos * path[:, 1],
                            yaw + path[:, 2]])


def heading_of(path):
    """Unit vector of a path's first motion."""
    steps = path[:, :2] - path[0, :2]
    lengths = np.hypot(*steps.T)
    first = int(np.argmax(lengths > 1e-4))
    return steps[first] / max(lengths[first], 1e-9)


def nearest(point, path):
    """(distance [m], yaw [rad]) of the path's nearest place."""
    begin, step = path[:-1], np.diff(path, axis=0)
    square_lengths = np.maximum(np.sum(step[:, :2] ** 2, axis=1), 1e-12)
    part = np.clip(np.sum((point - begin[:, :2]) * step[:, :2], axis=1) / square_lengths, 0.0, 1.0)
    places = begin + part[:, None] * step
    distances = np.hypot(*(places[:, :2] - point).T)
    best = int(np.argmin(distances))
    return float(distances[best]), float(places[best, 2])
