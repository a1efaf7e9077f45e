"""What stands in a world besides walls and boxes, or is painted on them: posts, coloured things, lines, pictures, tags.

All of it becomes plain shapes, so that the physics, the camera and RViz draw the same.
"""

import math
from typing import NamedTuple, Tuple

HEIGHT = 0.4         # [m] of walls, boxes and posts
THING_HEIGHT = 0.25  # [m] of coloured things: seen by the laser, too
LINE_WIDTH = 0.05    # [m] of lines on the floor
PICTURE_HEIGHT = 0.2  # [m] of the middle of a picture or tag above the floor
PAINT = 0.002        # [m] thickness of what is painted
COLOURS = {"black": (0.03, 0.03, 0.03), "white": (0.95, 0.95, 0.95), "red": (0.8, 0.08, 0.08),
           "green": (0.1, 0.6, 0.15), "blue": (0.1, 0.2, 0.8), "yellow": (0.9, 0.8, 0.05)}
LETTERS = {"k": "black", **{name[0]: name for name in COLOURS if name != "black"}}  # of a picture's rows
# What each key of a world file lists, for `_read` of world.py: the numbers [m], [rad], and what follows them
KEYS = {"posts": (3, "x, y, radius"), "things": (3, "x, y, radius, colour"), "lines": (4, "x1, y1, x2, y2, colour"),
        "tags": (5, "x, y, yaw, size, number"), "pictures": (4, "x, y, yaw, size, row, ... of letters of colours")}


class Shape(NamedTuple):
    """A box, or an upright cylinder, with its middle at x, y, z, turned by yaw [m, rad]."""

    kind: str      # of KEYS
    round: bool
    x: float
    y: float
    z: float
    length: float  # along its own x; of a cylinder its diameter
    width: float
    height: float
    yaw: float
    colour: Tuple[float, float, float]  # red, green, blue, 0 to 1

    @property
    def solid(self):
        """Whether the robot can touch it."""
        return self.kind in ("posts", "things")


def shapes(kind, entry):
    """The `Shape`s of an entry of a world file: a list of numbers and words as KEYS has it. Raises ValueError."""
    count, words = KEYS[kind]
    numbers, rest = entry[:count], entry[count:]
    if kind in ("posts", "things"):
        x, y, radius = numbers
        height = HEIGHT if kind == "posts" else THING_HEIGHT
        colour = COLOURS["white"] if kind == "posts" else _colour(rest, words)
        return [Shape(kind, True, x, y, height / 2, 2 * radius, 2 * radius, height, 0.0, colour)]
    if kind == "lines":
        x1, y1, x2, y2 = numbers
        length = math.hypot(x2 - x1, y2 - y1) + LINE_WIDTH
        return [Shape(kind, False, (x1 + x2) / 2, (y1 + y2) / 2, 0.0, length, LINE_WIDTH, 2 * PAINT,
                      math.atan2(y2 - y1, x2 - x1), _colour(rest, words))]
    if kind == "tags":
        x, y, yaw, size, number = numbers
        if number not in range(256):
            raise ValueError(f"a number of 0 to 255, found {number:g}")
        rows = ["w" + row + "w" for row in tag(int(number))]
        size *= 11 / 9  # a tag's size is that of its black part; around it is one row of white
        return _painted(kind, x, y, yaw, size, ["w" * 11, *rows, "w" * 11])
    sizes = {len(row) if isinstance(row, str) and set(row) <= set(LETTERS) else 0 for row in rest}
    if len(sizes) != 1 or 0 in sizes:
        raise ValueError(f"rows of one length, of the letters {' '.join(LETTERS)}")
    return _painted(kind, *numbers, rest)


def _colour(rest, words):
    if len(rest) != 1 or rest[0] not in list(COLOURS):
        raise ValueError(f"{words}, with a colour of {', '.join(COLOURS)}")
    return COLOURS[rest[0]]


def _painted(kind, x, y, yaw, width, rows):
    """Runs of one colour, on a wall whose face at x, y looks towards `yaw`; the rows from the top."""
    cell, found = width / len(rows[0]), []
    for number, row in enumerate(rows):
        start = 0
        for column in range(1, len(row) + 1):
            if column < len(row) and row[column] == row[start]:
                continue
            left = width / 2 - (start + column) / 2 * cell  # to the left of who looks out of the wall
            found.append(Shape(kind, False, x + left * math.sin(yaw), y - left * math.cos(yaw),
                               PICTURE_HEIGHT + (len(rows) / 2 - number - 0.5) * cell, 2 * PAINT,
                               (column - start) * cell, cell, yaw, COLOURS[LETTERS[row[start]]]))
            start = column
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
