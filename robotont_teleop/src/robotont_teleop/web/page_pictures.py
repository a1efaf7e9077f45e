"""Maps, scans and what is near, in the form in which pages draw them."""

import contextlib
import io
import math
import zlib

import numpy as np
from PIL import Image

from robotont_driver.kinematics.se2 import pose_of
from robotont_teleop.hand.robot_reports import finite
from robotont_teleop.hand.sensor_view import REACH, look, reading_of

LARGEST_MAP = 4000 * 4000  # [cells]
SCAN_RAYS = 180            # at most
LEVEL = 0.98               # cosine of the largest tilt of a scan that is drawn flat
SECTORS = 24               # of what is near
OCCUPIED, FREE, UNKNOWN = (130, 255), (255, 48), (0, 64)  # (grey, opacity): on light and on dark ground alike


def map_picture(message):
    """(PNG, {number, width [m], height [m], origin: (x, y, yaw)}) of an OccupancyGrid. Raises ValueError."""
    info = message.info
    place = pose_of(info.origin)
    if not (info.resolution > 0 and all(map(math.isfinite, (info.resolution, *place)))):
        raise ValueError(f"a resolution of {info.resolution:g} m at {place}")
    if not 0 < info.width * info.height <= LARGEST_MAP or len(message.data) != info.width * info.height:
        raise ValueError(f"{info.width} x {info.height} cells with {len(message.data)} values; "
                         f"allowed: up to {LARGEST_MAP}")
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)[::-1]
    pixels = np.full((*cells.shape, 2), UNKNOWN, dtype=np.uint8)
    pixels[cells >= 0] = FREE
    pixels[cells >= 50] = OCCUPIED
    output = io.BytesIO()
    Image.fromarray(pixels, "LA").save(output, "PNG")
    size = info.width * info.resolution, info.height * info.resolution
    # of what it shows: a page that stays open over a restart of this node takes no other map for its own
    number = zlib.crc32(repr((size, place)).encode(), zlib.crc32(output.getvalue()))
    return output.getvalue(), {"number": number, "width": size[0], "height": size[1], "origin": place}


def scan_points(message, laser):
    """[[x, y]] [m] on the robot that up to SCAN_RAYS of a LaserScan hit; none where it is tilted: it may be the floor.

    laser: (3 x 3 rotation, (x, y, z) [m]) on the robot.
    """
    rotation, origin = laser
    if abs(rotation[2, 2]) < LEVEL:
        return []
    angles, ranges, (least, most) = reading_of(message)
    rays = slice(None, None, max(1, math.ceil(len(ranges) / SCAN_RAYS)))
    lengths = np.where(np.isfinite(ranges) & (ranges >= least) & (ranges <= most), ranges, np.nan)[rays]
    points = (rotation[:2, :2].dot((np.cos(angles[rays]), np.sin(angles[rays]))) * lengths).T + origin[:2]
    return points[np.isfinite(points).all(axis=1)].round(2).tolist()


def nearest(readings, body):
    """[m] from the robot's rim to the nearest thing in each of SECTORS, from ahead to the left; None: unseen there.

    readings: (place, angles, ranges, bounds) of each sensor; body: of the robot; all as the guard's `look` takes them.
    """
    gaps = np.full(SECTORS, np.nan)
    for place, angles, ranges, bounds in readings:
        with contextlib.suppress(ValueError):
            points, rays, reach, _ = look(place, angles, ranges, bounds, False, body)
            for found, gap in ((rays[reach > body[0]], REACH), (points, abs(points) - body[0])):
                np.fmin.at(gaps, np.rint(np.angle(found) * SECTORS / (2 * math.pi)).astype(int) % SECTORS, gap)
    return [finite(float(gap), 2) for gap in gaps]
