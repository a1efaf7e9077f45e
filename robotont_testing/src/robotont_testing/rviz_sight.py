"""Reads a picture of RViz: the grid, the robot on it, the path, complaints of displays.

Pictures are height x width x 3 integers of 0 to 255: red, green, blue. The colours are those of
rviz/*.rviz and urdf/shapes.xacro in RViz's light, as they look from straight above.
"""

import numpy as np

VIEW = (slice(62, 770), slice(364, 1264))  # rows and columns of the window's 3D part
NAMES = (slice(82, 720), slice(44, 188))   # and of the names of the displays, without their icons
PLATE = 0.125                              # [m] radius of the upper plate


class UnseenError(AssertionError):
    """Something is not in the picture."""


def grid_lines(picture):
    """Columns and rows [pixels] of the grid's lines, as two arrays; lines are grey and span the view."""
    red, green, blue = np.moveaxis(picture[VIEW], 2, 0)
    spread = np.maximum(np.maximum(red, green), blue) - np.minimum(np.minimum(red, green), blue)
    brightness = red + green + blue
    grey = (spread < 16) & (brightness > 3 * 195) & (brightness < 3 * 243)
    return _middles(grey.mean(axis=0) > 0.6) + VIEW[1].start, _middles(grey.mean(axis=1) > 0.6) + VIEW[0].start


def scale(picture):
    """[pixels/m] from the grid, whose lines are 1 m apart. Raises UnseenError."""
    columns, lines = grid_lines(picture)
    gaps = np.concatenate([np.diff(columns), np.diff(lines)])
    if not len(gaps) or gaps.max() - gaps.min() > 1.5:
        raise UnseenError(f"no even grid, but gaps {gaps}")
    return gaps.mean()


def robot_centre(picture):
    """(column, row) [pixels] of the round upper plate's middle. Raises UnseenError without a disc of the right size."""
    view = picture[VIEW]
    red, green, blue = np.moveaxis(view, 2, 0)
    plate = (blue - red > 30) & (blue - red < 75) & (green - red > 10) & (blue > 190)
    centre = []
    for axis in (0, 1):
        wide = np.nonzero(plate.sum(axis=axis) >= 5)[0]  # single pixels of other things are no plate
        if not len(wide):
            raise UnseenError("no robot")
        diameter = (wide[-1] - wide[0] + 1) / scale(picture)
        if abs(diameter - 2 * PLATE) > 0.02:
            raise UnseenError(f"a robot of {diameter:.3f} m instead of {2 * PLATE} m")
        centre.append((wide[0] + wide[-1]) / 2 + VIEW[1 - axis].start)
    return tuple(centre)


def position(picture):
    """(x, y) [m] of the robot from the lower left crossing of the grid's lines that can be seen."""
    columns, lines = grid_lines(picture)
    per_metre, (column, row) = scale(picture), robot_centre(picture)
    return (column - columns[0]) / per_metre, (lines[-1] - row) / per_metre


def heading(picture):
    """Yaw [rad] from the robot's middle to its darkest part, the camera."""
    column, row = (round(number) for number in robot_centre(picture))
    reach = round(PLATE * scale(picture)) - 4  # within the wheels, which are dark in places
    part = picture[row - reach:row + reach + 1, column - reach:column + reach + 1]
    rows, columns = np.nonzero(part.max(axis=2) < 70)
    if len(rows) < 50:
        raise UnseenError("no camera")
    # medians: where wheels and cables are shaded, single pixels are as dark
    return np.arctan2(reach - np.median(rows), np.median(columns) - reach)


def is_way(picture, column, row):
    """Whether a pixel within 9 of the given one has the colour of the way's dots, teal, which are 16 pixels apart."""
    part = picture[row - 9:row + 10, column - 9:column + 10]
    return bool((np.abs(part - (60, 140, 125)).max(axis=2) < 16).any())


def complaints(picture):
    """Number of red or orange pixels among the names of the displays: those of errors and warnings."""
    red, green, blue = np.moveaxis(picture[NAMES], 2, 0)
    return int(((red - blue > 60) & (red >= green)).sum())


def content_displays(picture):
    """Number of names in the blue that RViz gives to displays that are on and have nothing to complain of."""
    red, _, blue = np.moveaxis(picture[NAMES], 2, 0)
    lines = (blue - red > 60).any(axis=1)
    return int((np.diff(lines.astype(int)) == 1).sum())


def _middles(flags):
    """Middle of each run of true flags."""
    edges = np.diff(np.concatenate([[0], flags.astype(int), [0]]))
    return (np.nonzero(edges == 1)[0] + np.nonzero(edges == -1)[0] - 1) / 2
