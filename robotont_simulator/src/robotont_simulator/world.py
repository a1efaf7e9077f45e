"""Worlds: a file of walls and boxes, for the physics and, drawn as a map, for navigation."""

import math
import os
from pathlib import Path
from typing import NamedTuple, Tuple

import numpy as np
from scipy import ndimage

from robotont_driver.parameters.files import MOST_BYTES, read_file, read_mapping, write_file
from robotont_driver.parameters.parameters import fault, is_number, shown
from robotont_simulator.scenery import KEYS, Shape, shapes

WALL_THICKNESS = 0.1  # [m]
LARGEST_NUMBER = 1000.0  # [m] or [rad] in a world file


class Box(NamedTuple):
    """A box that stands on the floor: centre, size along its own axes, and yaw."""

    x: float       # [m]
    y: float       # [m]
    length: float  # [m] along its x
    width: float   # [m] along its y
    yaw: float     # [rad]


class World(NamedTuple):
    """Obstacles around the robot, and its start."""

    boxes: Tuple[Box, ...]
    start: Tuple[float, float, float]  # x [m], y [m], yaw [rad]
    scenery: Tuple[Shape, ...] = ()    # what else stands there, or is painted on walls and floor
    tags: Tuple[Tuple[float, ...], ...] = ()  # x, y [m], yaw [rad] where it looks, size [m], number
    others: int = 0                    # robots beside this one

    @property
    def posts(self):
        """The `Shape`s that the robot can touch, all of them upright cylinders."""
        return [shape for shape in self.scenery if shape.solid]


class WorldError(ValueError):
    """A world file that cannot be used; states the found and the allowed values."""


def read_world(file):
    """`World` of a YAML file; raises WorldError.

    Its keys, each optional, in m and rad: `walls`, a list of [x1, y1, x2, y2]; `boxes`, a list of
    [x, y, length, width, yaw]; `start`, [x, y, yaw]; and lists of what KEYS has.
    """
    keys = ("walls", "boxes", *KEYS, "start")
    allowed = f"{', '.join(keys[:-1])} and {keys[-1]}"
    try:
        content, _ = read_mapping(file, allowed)
    except ValueError as error:
        raise WorldError(str(error)) from None
    unknown = set(content) - set(keys)
    if unknown:
        raise WorldError(f"{file}: found {', '.join(sorted(map(shown, unknown)))}, allowed: {allowed}")
    walls = [_wall(*wall) for wall in _lists(file, content, "walls", 4)]
    boxes = [Box(*box) for box in _lists(file, content, "boxes", 5)]
    for box in boxes:
        if box.length <= 0 or box.width <= 0:
            raise WorldError(f"{file}: boxes: found {list(box)}, allowed: length and width > 0 [m]")
    start = _numbers(file, "start", content.get("start", [0, 0, 0]), 3)
    painted = tuple(shape for kind in KEYS for entry in _entries(file, content, kind, "lists")
                    for shape in _shapes(file, kind, entry))
    return World(tuple(walls + boxes), tuple(start), painted, tuple(map(tuple, content.get("tags") or ())))


def _entries(file, content, key, lists):
    """The list under a key; empty where it is missing."""
    values = content.get(key) or []
    if not isinstance(values, list):
        raise WorldError(fault(f"{file}: {key}", values, f"a list of {lists}"))
    return values


def _lists(file, content, key, count):
    """The lists of `count` numbers under a key; none where it is missing or empty."""
    return [_numbers(file, key, value, count) for value in _entries(file, content, key, f"lists of {count} numbers")]


def _shapes(file, kind, entry):
    """The shapes of an entry of the scenery."""
    count, words = KEYS[kind]
    if not isinstance(entry, list) or len(entry) < count:
        raise WorldError(fault(f"{file}: {kind}", entry, f"lists of {words}"))
    numbers = _numbers(file, kind, entry[:count], count)
    if kind != "lines" and numbers[3 if len(numbers) > 3 else 2] <= 0:
        raise WorldError(fault(f"{file}: {kind}", entry, f"lists of {words}, with a size > 0 [m]"))
    try:
        return shapes(kind, [*numbers, *entry[count:]])
    except ValueError as error:
        raise WorldError(fault(f"{file}: {kind}", entry, f"lists of {error}")) from None


def _numbers(file, key, values, count):
    good = isinstance(values, list) and len(values) == count and all(
        is_number(value) and abs(value) <= LARGEST_NUMBER for value in values)
    if not good:
        raise WorldError(fault(f"{file}: {key}", values, f"lists of {count} numbers up to {LARGEST_NUMBER:g}"))
    return [float(value) for value in values]


def _wall(x1, y1, x2, y2):
    length = math.hypot(x2 - x1, y2 - y1) + WALL_THICKNESS
    return Box((x1 + x2) / 2, (y1 + y2) / 2, length, WALL_THICKNESS, math.atan2(y2 - y1, x2 - x1))


HEAD = "# Written by make_map from the simulator's world"  # of a map's file
LARGEST_MAP = 5 * 10 ** 7  # [pixels]; it takes 100 bytes a pixel to draw
OCCUPIED, UNKNOWN, FREE = 0, 205, 254  # pixels of map_server


def draw_map(world, resolution=0.05, margin=0.5):
    """(image, origin) of a world as a robot maps it that goes wherever it can from the start.

    FREE where it can get, OCCUPIED the one cell of each wall where a laser's ray ends, UNKNOWN behind: within a solid
    block amcl's likelihood field is flat, and the pose would slide into the wall by up to the wall's thickness.
    image: H x W of uint8, one pixel per `resolution` [m], rows from the top. origin: (x, y) [m] of the lower left
    corner; half a cell off the whole cells, so that faces at whole cells lie in the middle of a pixel.
    Raises WorldError for a world without anything in it, and for one whose start is in a wall.
    """
    solids = [*world.boxes, *(Box(post.x, post.y, post.length, post.width, 0.0) for post in world.posts)]
    if not solids:
        raise WorldError("a world without walls and boxes has no map")
    x, y, length, width, yaw = np.array([*solids, (*world.start[:2], 0.0, 0.0, 0.0)]).T
    cos, sin = abs(np.cos(yaw)), abs(np.sin(yaw))
    reach = np.array([cos * length + sin * width, sin * length + cos * width]) / 2 + margin  # from a box's middle
    middles = np.array((x, y))
    low = (np.floor((middles - reach).min(axis=1) / resolution) - 0.5) * resolution
    size = np.ceil(((middles + reach).max(axis=1) - low) / resolution).astype(int)
    if size.prod(dtype=float) > LARGEST_MAP:
        raise WorldError(f"found a map of {size[0]} x {size[1]} pixels, allowed: {LARGEST_MAP} in all; too large?")
    x = low[0] + (np.arange(size[0]) + 0.5) * resolution
    y = low[1] + (np.arange(size[1]) + 0.5) * resolution
    x, y = np.meshgrid(x, y[::-1])
    solid = np.zeros(x.shape, bool)
    for box in world.boxes:
        cos, sin = math.cos(box.yaw), math.sin(box.yaw)
        # what is thinner than a cell, at any angle, has the middle of one
        length, width = (side if side >= resolution else 1.4143 * resolution for side in (box.length, box.width))
        along = abs(cos * (x - box.x) + sin * (y - box.y)) - length / 2
        across = abs(-sin * (x - box.x) + cos * (y - box.y)) - width / 2
        solid |= np.maximum(along, across) <= resolution * 1e-6
    for post in world.posts:
        solid |= np.hypot(x - post.x, y - post.y) <= max(post.length / 2, 0.7072 * resolution)
    start = np.unravel_index(np.argmin((x - world.start[0]) ** 2 + (y - world.start[1]) ** 2), x.shape)
    regions, _ = ndimage.label(~solid)
    free = (regions == regions[start]) & ~solid
    if solid[start]:
        raise WorldError(f"the start ({world.start[0]:g}, {world.start[1]:g}) is in a wall or a box")
    image = np.full(x.shape, UNKNOWN, np.uint8)
    image[free] = FREE
    image[ndimage.binary_dilation(free) & solid] = OCCUPIED
    return image, (float(low[0]), float(low[1]))


def write_map(world, file, resolution=0.05):
    """Write FILE.pgm and FILE.yaml for map_server; returns the YAML's path. `file`: a path without ending.

    Raises WorldError where one of them is there that make_map has not written: the world itself, a map of a real room.
    """
    picture, description = Path(f"{file}.pgm"), Path(f"{file}.yaml")
    known = os.path.isfile(str(description)) and read_file(description, MOST_BYTES).startswith(HEAD.encode())
    for path in (description, picture):
        if os.path.lexists(str(path)) and not known:
            raise WorldError(f"{path} is there and make_map has not written it: give the map another name")
    image, origin = draw_map(world, resolution)
    height, width = image.shape
    write_file(picture, b"P5\n%d %d\n255\n" % (width, height) + image.tobytes())
    write_file(description, (
        f"{HEAD}; do not edit.\n"
        f"image: {picture.name}\nresolution: {resolution}   # [m] per pixel\n"
        f"origin: [{origin[0]:.3f}, {origin[1]:.3f}, 0.0]   # [m, m, rad] lower left corner\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196   # so that grey, 205, is unknown\n"))
    return description
