"""Worlds: a file of walls, boxes and scenery, for the physics and, drawn as a map, for navigation."""

import os
from pathlib import Path
from typing import NamedTuple, Tuple

import numpy as np
from scipy import ndimage

from robotont_driver.parameters.files import MOST_BYTES, read_file, read_mapping, write_file
from robotont_driver.parameters.parameters import fault, shown
from robotont_simulator.scenery import KEYS, LARGEST_NUMBER, Shape, are_numbers, shapes


class World(NamedTuple):
    """What stands around the robot or is painted there, and the robot's start."""

    shapes: Tuple[Shape, ...] = ()
    start: Tuple[float, float, float] = (0.0, 0.0, 0.0)  # x [m], y [m], yaw [rad]
    tags: Tuple[Tuple[float, ...], ...] = ()  # x, y [m], yaw [rad] where it looks, size [m], number
    others: int = 0  # robots beside this one

    @property
    def solids(self):
        """The `Shape`s that the robot can touch."""
        return [shape for shape in self.shapes if shape.solid]


def read_world(file):
    """`World` of a YAML file: lists of what KEYS has, and `start`, [x, y, yaw], all optional. Raises ValueError."""
    keys = (*KEYS, "start")
    allowed = f"{', '.join(KEYS)} and start"
    content, _ = read_mapping(file, allowed)
    unknown = set(content) - set(keys)
    if unknown:
        raise ValueError(f"{file}: found {', '.join(sorted(map(shown, unknown)))}, allowed: {allowed}")
    start, found = content.pop("start", [0, 0, 0]), []
    if not are_numbers(start, 3):
        raise ValueError(fault(f"{file}: start", start, f"lists of 3 numbers up to {LARGEST_NUMBER:g}"))
    for kind, entries in sorted(content.items(), key=lambda one: keys.index(one[0])):
        if not isinstance(entries, list) and entries is not None:
            raise ValueError(fault(f"{file}: {kind}", entries, f"a list of lists of {KEYS[kind][2]}"))
        for entry in entries or ():
            try:
                found += shapes(kind, entry)
            except ValueError as error:
                raise ValueError(fault(f"{file}: {kind}", entry, str(error))) from None
    return World(tuple(found), tuple(map(float, start)), tuple(map(tuple, content.get("tags") or ())))


RESOLUTION = 0.05  # [m] per pixel of a map
HEAD = "# Written by make_map from the simulator's world"  # of a map's file
LARGEST_MAP = 5 * 10 ** 7  # [pixels]; it takes 100 bytes a pixel to draw
OCCUPIED, UNKNOWN, FREE = 0, 205, 254  # pixels of map_server


def draw_map(world, resolution=RESOLUTION, margin=0.5):
    """(image, origin) of a world as a robot maps it that goes wherever it can from the start.

    FREE where it can get, OCCUPIED the one cell of each wall where a laser's ray ends, UNKNOWN behind: within a solid
    block amcl's likelihood field is flat, and the pose would slide into the wall by up to the wall's thickness.
    image: H x W of uint8, one pixel per `resolution` [m], rows from the top. origin: (x, y) [m] of the lower left
    corner; half a cell off the whole cells, so that faces at whole cells lie in the middle of a pixel.
    Raises ValueError for a world without anything in it, and for one whose start is in a wall.
    """
    if not world.solids:
        raise ValueError("a world without walls and boxes has no map")
    x, y, length, width, yaw = np.array([
        *((shape.x, shape.y, shape.length, shape.width, shape.yaw) for shape in world.solids),
        (*world.start[:2], 0.0, 0.0, 0.0)]).T
    cos, sin = abs(np.cos(yaw)), abs(np.sin(yaw))
    reach = np.array([cos * length + sin * width, sin * length + cos * width]) / 2 + margin  # from a box's middle
    middles = np.array((x, y))
    low = (np.floor((middles - reach).min(axis=1) / resolution) - 0.5) * resolution
    size = np.ceil(((middles + reach).max(axis=1) - low) / resolution).astype(int)
    if size.prod(dtype=float) > LARGEST_MAP:
        raise ValueError(f"found a map of {size[0]} x {size[1]} pixels, allowed: {LARGEST_MAP} in all; too large?")
    x, y = (low[axis] + (np.arange(size[axis]) + 0.5) * resolution for axis in (0, 1))
    x, y = np.meshgrid(x, y[::-1])
    solid = np.zeros(x.shape, bool)
    for shape in world.solids:  # what is thinner than a cell, at any angle, has the middle of one
        length, width = (max(side, 1.4143 * resolution) if shape.round or side < resolution else side
                         for side in (shape.length, shape.width))
        solid |= shape._replace(length=length, width=width).distance(x, y) <= resolution * 1e-6
    start = np.unravel_index(np.argmin((x - world.start[0]) ** 2 + (y - world.start[1]) ** 2), x.shape)
    if solid[start]:
        raise ValueError(f"the start ({world.start[0]:g}, {world.start[1]:g}) is in a wall or a box")
    regions, _ = ndimage.label(~solid)
    free = regions == regions[start]
    image = np.full(x.shape, UNKNOWN, np.uint8)
    image[free] = FREE
    image[ndimage.binary_dilation(free) & solid] = OCCUPIED
    return image, (float(low[0]), float(low[1]))


def write_map(world, file):
    """Write FILE.pgm and FILE.yaml for map_server; returns the YAML's path. `file`: a path without ending.

    Raises ValueError where one of them is there that make_map has not written: the world itself, a map of a real room.
    """
    picture, description = Path(f"{file}.pgm"), Path(f"{file}.yaml")
    known = os.path.isfile(str(description)) and read_file(description, MOST_BYTES).startswith(HEAD.encode())
    for path in (description, picture):
        if os.path.lexists(str(path)) and not known:
            raise ValueError(f"{path} is there and make_map has not written it: give the map another name")
    image, origin = draw_map(world)
    height, width = image.shape
    write_file(picture, b"P5\n%d %d\n255\n" % (width, height) + image.tobytes())
    write_file(description, (
        f"{HEAD}; do not edit.\n"
        f"image: {picture.name}\nresolution: {RESOLUTION}   # [m] per pixel\n"
        f"origin: [{origin[0]:.3f}, {origin[1]:.3f}, 0.0]   # [m, m, rad] lower left corner\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196   # so that grey, 205, is unknown\n"))
    return description
