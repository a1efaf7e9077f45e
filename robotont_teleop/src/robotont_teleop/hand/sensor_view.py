"""What one reading of a sensor shows around the robot, free of ROS and clock; places are x + iy [m] in base_link."""

import numpy as np

REACH = 2.0   # [m] farther things do not count
LEVEL = 0.05  # [m] by which a ray may fall or rise below or above its sensor, and is not yet at floor or ceiling
FAN = np.linspace(-0.5, 0.5, 16)  # what a range sensor has measured may be anywhere in its field of view


def reading_of(message):
    """(angles, ranges, bounds) of a LaserScan or a Range, as `look` takes them."""
    if hasattr(message, "range"):
        return FAN * message.field_of_view, message.range, (message.min_range, message.max_range)
    angles = message.angle_min + message.angle_increment * np.arange(len(message.ranges))
    return angles, np.array(message.ranges), (message.range_min, message.range_max)


def look(place, angles, ranges, bounds, able, body):
    """(points, rays, reach, able): obstacles; each ray's direction, and how far [m] it shows what is there.

    By REP 117 inf is nothing within range, -inf what is too near: counted at its least if the ray has ever measured
    (able), else it looks at the robot. All else outside the range (NaN, 0, -1, 65535) is no reading. place: (3 x 3
    rotation, (x, y, z) [m]). angles: N [rad]; ranges: N or one [m]; bounds: least and largest. body: as in `Guard`.
    Raises ValueError, with the reason, for a sensor that cannot be used.
    """
    (rotation, (x, y, height)), (radius, floor, top) = place, body
    rays = np.dot(rotation, (np.cos(angles), np.sin(angles), 0.0 * angles))
    flat, rise = rays[0] + 1j * rays[1], np.where(rays[2], rays[2], 1e-9)
    ends = np.where(rise < 0.0, min(floor, height - LEVEL), max(top, height + LEVEL)) - height
    longest = np.minimum(ends / rise, min(REACH, bounds[1]))
    shown = abs(x + 1j * y + longest * flat)
    if not (shown.max(initial=0.0) > radius and bounds[0] <= bounds[1]):
        raise ValueError("no rays, no range, or it looks only at the floor, above the robot or at the robot")
    measured, free = (ranges > 0.0) & (ranges >= bounds[0]) & (ranges <= bounds[1]), ranges == np.inf
    able = able | measured | free
    lengths = np.where(able & (ranges == -np.inf), bounds[0], np.where(measured, ranges, np.inf))
    points, hit = x + 1j * y + np.minimum(lengths, REACH) * flat, lengths <= longest
    outside = hit & (abs(points) > radius)
    return points[outside], flat, np.where(outside, REACH, np.where(~hit & (measured | free), shown, 0.0)), able
