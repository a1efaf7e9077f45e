"""Worlds: what stands there, or is painted: walls, boxes, posts, coloured things, lines, pictures, tags.

All of it becomes plain shapes, so that physics, laser, camera, map, RViz and judge have the same.
"""

import itertools
import math
from pathlib import Path
from typing import NamedTuple, Tuple

import numpy as np
from scipy import ndimage

from robotont_driver.kinematics import se2
from robotont_driver.parameters.files import read_file, write_file
from robotont_driver.parameters.parameters import fault, is_number, shown
from robotont_driver.parameters.yaml_file import MOST_BYTES, read_mapping

HEIGHT = 0.4         # [m] of walls, boxes and posts
WALL_THICKNESS = 0.1  # [m]
THING_HEIGHT = 0.25  # [m] of coloured things; a laser on large wheels looks over them
LINE_WIDTH = 0.05    # [m] of lines on the floor
PICTURE_HEIGHT = 0.2  # [m] of the middle of a picture or tag above the floor
PAINT = 0.002        # [m] thickness of what is painted
LARGEST_NUMBER = 1000.0  # [m] or [rad] in a world file
WALL_COLOUR = (0.72, 0.72, 0.7)
COLOURS = {"black": (0.03, 0.03, 0.03), "white": (0.95, 0.95, 0.95), "red": (0.8, 0.08, 0.08),
           "green": (0.1, 0.6, 0.15), "blue": (0.1, 0.2, 0.8), "yellow": (0.9, 0.8, 0.05)}
LETTERS = {"k": "black", **{name[0]: name for name in COLOURS if name != "black"}}  # of a picture's rows
KEYS = {  # of a world file: how many numbers [m], [rad] an entry has, which of them are sizes, and what it lists
    "walls": (4, (), "x1, y1, x2, y2"), "boxes": (5, (2, 3), "x, y, length, width, yaw"),
    "posts": (3, (2,), "x, y, radius"), "things": (3, (2,), "x, y, radius, colour"),
    "lines": (4, (), "x1, y1, x2, y2, colour"), "tags": (5, (3,), "x, y, yaw, size, number"),
    "pictures": (4, (3,), "x, y, yaw, size, row, ... of letters of colours")}


class Shape(NamedTuple):
    """A box, or an upright cylinder, with its middle at x, y, z, turned by yaw [m, rad]."""

    kind: str      # of KEYS
    x: float
    y: float
    z: float
    length: float  # along its own x; of a cylinder its diameter
    width: float
    height: float
    yaw: float
    colour: Tuple[float, float, float] = WALL_COLOUR  # red, green, blue, 0 to 1

    @property
    def round(self):
        """Whether it is a cylinder."""
        return self.kind in ("posts", "things")

    @property
    def solid(self):
        """Whether the robot can touch it; the laser sees nothing else."""
        return self.kind not in ("lines", "tags", "pictures")

    def distance(self, x, y):
        """[m] of places on the floor (numbers or arrays) from its side; below 0 within."""
        if self.round:
            return np.hypot(x - self.x, y - self.y) - self.length / 2
        along, across, _ = se2.between((self.x, self.y, self.yaw), (x, y, 0.0))
        along, across = abs(along) - self.length / 2, abs(across) - self.width / 2
        return np.hypot(np.maximum(along, 0), np.maximum(across, 0)) + np.minimum(np.maximum(along, across), 0)


def box(x, y, length, width, yaw):
    """The `Shape` of a box on the floor: its middle, its size along its own axes [m], and yaw [rad]."""
    return Shape("boxes", x, y, HEIGHT / 2, length, width, HEIGHT, yaw)


def are_numbers(values, count):
    """Whether `values`, of a file, are a list of so many numbers that a world may have."""
    return isinstance(values, list) and len(values) == count and all(
        is_number(value) and abs(value) <= LARGEST_NUMBER for value in values)


def shapes(kind, entry):
    """The `Shape`s of an entry of a world file, in the list KEYS[kind]. Raises ValueError, with what is allowed."""
    count, sizes, words = KEYS[kind]
    words = f"lists of {words}: numbers up to {LARGEST_NUMBER:g}, sizes > 0"
    numbers, rest = (entry[:count], entry[count:]) if isinstance(entry, list) else (None, [])
    if not are_numbers(numbers, count) or any(numbers[place] <= 0 for place in sizes):
        raise ValueError(words)
    x, y, *_ = numbers
    if kind == "pictures":
        lengths = {len(row) if isinstance(row, str) and set(row) <= set(LETTERS) else 0 for row in rest}
        if len(lengths) != 1 or 0 in lengths:
            raise ValueError(f"{words}, rows of one length, of the letters {' '.join(LETTERS)}")
        return _painted(kind, *numbers, rest)
    colours = [COLOURS[word] for word in rest if word in list(COLOURS)]
    if len(rest) != ("colour" in words) or len(colours) != len(rest):
        raise ValueError(f"{words}, with a colour of {', '.join(COLOURS)}" if "colour" in words else words)
    if kind == "tags":
        *place, size, number = numbers
        if number not in range(256):
            raise ValueError(f"{words}, a tag's number 0 to 255")
        rows = ["w" * 11, *("w" + row + "w" for row in tag(int(number))), "w" * 11]
        return _painted(kind, *place, size * 11 / 9, rows)  # its size is that of its black part
    if kind == "boxes":
        return [box(*numbers)]
    if kind in ("posts", "things"):
        wide, height = 2 * numbers[2], HEIGHT if kind == "posts" else THING_HEIGHT
        return [Shape(kind, x, y, height / 2, wide, wide, height, 0.0, *colours or [COLOURS["white"]])]
    x2, y2 = numbers[2:]
    wide, high, z = (WALL_THICKNESS, HEIGHT, HEIGHT / 2) if kind == "walls" else (LINE_WIDTH, 2 * PAINT, 0.0)
    return [Shape(kind, (x + x2) / 2, (y + y2) / 2, z, math.hypot(x2 - x, y2 - y) + wide, wide, high,
                  math.atan2(y2 - y, x2 - x), *colours)]


def _painted(kind, x, y, yaw, width, rows):
    """Runs of one colour, on a wall whose face at x, y looks towards `yaw`; the rows from the top."""
    cell, found = width / len(rows[0]), []
    for number, row in enumerate(rows):
        right, z = -width / 2, PICTURE_HEIGHT + (len(rows) / 2 - number - 0.5) * cell
        for letter, run in itertools.groupby(row):
            wide = cell * len(list(run))
            # the rows begin at the left of who looks at the wall, on the right of who looks out of it
            place = se2.compose((x, y, yaw), (0.0, right + wide / 2, 0.0))
            found.append(Shape(kind, *place[:2], z, 2 * PAINT, wide, cell, yaw, COLOURS[LETTERS[letter]]))
            right += wide
    return found


def tag(number):
    """Rows of k and w of ALVAR's marker of 5 x 5 cells and a border of two, 9 x 9 together: as ar_track_alvar reads it.

    Each half of the number (0 to 255) is a Hamming code of eight bits; a set bit is black. The middle row tells the
    resolution, the middle column which way is up.
    """
    bits = []
    for half in (number >> 4, number & 15):
        a, b, c, d = (half >> place & 1 for place in (3, 2, 1, 0))
        code = [a ^ b ^ d, a ^ c ^ d, a, b ^ c ^ d, b, c, d]
        bits += [*code, sum(code) % 2]
    cells = ["".join("wk"[bit] for bit in bits[first:first + 4]) for first in (0, 4, 8, 12)]
    rows = [row[:2] + middle + row[2:] for row, middle in zip(cells, "kkww")]
    rows.insert(2, "wkwkw")
    return ["k" * 9] * 2 + ["kk" + row + "kk" for row in rows] + ["k" * 9] * 2


class World(NamedTuple):
    """What stands around the robot or is painted there, and the robot's start."""

    shapes: Tuple[Shape, ...] = ()
    start: Tuple[float, float, float] = (0.0, 0.0, 0.0)  # x [m], y [m], yaw [rad]
    tags: Tuple[Tuple[float, ...], ...] = ()  # x, y [m], yaw [rad] where it looks, size [m], number
    others: Tuple[int, ...] = ()  # numbers of the robots beside this one

    @property
    def solids(self):
        """The `Shape`s that the robot can touch."""
        return [shape for shape in self.shapes if shape.solid]


def read_world(file):
    """`World` of a YAML file with any of KEYS and `start`; without file an empty one. Raises OSError, ValueError."""
    if not file:
        return World()
    if not Path(file).exists():
        others = ", ".join(sorted(other.stem for other in Path(file).resolve().parent.glob("*.yaml")))
        raise ValueError(f"world: found no file {Path(file).absolute()}, allowed: {others or 'a file that is there'}")
    allowed = f"{', '.join(KEYS)} and start"
    content, _ = read_mapping(file, allowed)
    unknown = set(content) - {*KEYS, "start"}
    if unknown:
        raise ValueError(f"{file}: found {', '.join(sorted(map(shown, unknown)))}, allowed: {allowed}")
    start, found = content.pop("start", [0, 0, 0]), []
    if not are_numbers(start, 3):
        raise ValueError(fault(f"{file}: start", start, f"lists of 3 numbers up to {LARGEST_NUMBER:g}"))
    for kind in KEYS:
        entries = content.get(kind)
        if not isinstance(entries, list) and entries is not None:
            raise ValueError(fault(f"{file}: {kind}", entries, f"a list of lists of {KEYS[kind][2]}"))
        for entry in entries or ():
            try:
                found += shapes(kind, entry)
            except ValueError as error:
                raise ValueError(fault(f"{file}: {kind}", entry, str(error))) from None
    return World(tuple(found), tuple(map(float, start)), tuple(map(tuple, content.get("tags") or ())))


RESOLUTION = 0.025  # [m] per pixel of a map: amcl's pose is off by half of it with the walls
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
    for shape in world.solids:  # what is thinner than a cell, at any angle, gets one
        length, width = (max(side, 0.4143 * resolution) if shape.round or side < resolution else side
                         for side in (shape.length, shape.width))
        # half a cell before the face: the cell that the face is in, not the one behind, is where rays end
        solid |= shape._replace(length=length, width=width).distance(x, y) < resolution * (0.5 - 1e-6)
    start = np.unravel_index(np.argmin((x - world.start[0]) ** 2 + (y - world.start[1]) ** 2), x.shape)
    if solid[start]:
        raise ValueError(f"the start ({world.start[0]:g}, {world.start[1]:g}) is in a wall or a thing")
    regions, _ = ndimage.label(~solid)
    free = regions == regions[start]
    image = np.select([free, ndimage.binary_dilation(free) & solid], [FREE, OCCUPIED], UNKNOWN).astype(np.uint8)
    return image, (float(low[0]), float(low[1]))


def write_map(world, file):
    """Write FILE.pgm and FILE.yaml for map_server; returns the YAML's path. `file`: a path without ending.

    Raises ValueError where one of them is there that make_map has not written: the world itself, a map of a real room.
    """
    picture, description = Path(f"{file}.pgm"), Path(f"{file}.yaml")
    known = description.is_file() and read_file(description, MOST_BYTES).startswith(HEAD.encode())
    for path in (description, picture):
        if (path.exists() or path.is_symlink()) and not known:
            raise ValueError(f"{path} is there and make_map has not written it: give the map another name")
    image, origin = draw_map(world)
    write_file(picture, b"P5\n%d %d\n255\n" % image.shape[::-1] + image.tobytes())
    write_file(description, (
        f"{HEAD}; do not edit.\n"
        f"image: {picture.name}\nresolution: {RESOLUTION}   # [m] per pixel\n"
        f"origin: [{origin[0]:.4f}, {origin[1]:.4f}, 0.0]   # [m, m, rad] lower left corner\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196   # so that grey, 205, is unknown\n"))
    return description
