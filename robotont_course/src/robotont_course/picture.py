"""The picture of a run, from above: the world, the true way with its seconds, and what was wrong where."""

import itertools
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import Affine2D

WAY, GOOD, BAD = "#1f4e79", "#2e7d32", "#b3261e"
COLUMNS = 5  # of a class's page, at most


def draw_run(run, faults, title, file):
    """Write a PNG file."""
    figure, axes = plt.subplots(figsize=(6.4, 6.0))
    _draw(axes, run, faults)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(_plain(title), fontsize=9, wrap=True, color=BAD if faults else GOOD)
    figure.tight_layout()
    figure.savefig(str(file), dpi=100)
    plt.close(figure)


def draw_class(results, file):
    """Write a PNG file with all runs of a class: (`judge.Run` or None, faults, title) of each."""
    columns = min(max(1, len(results)), COLUMNS)
    rows = max(1, math.ceil(len(results) / columns))
    figure, grid = plt.subplots(rows, columns, figsize=(3.0 * columns, 3.3 * rows), squeeze=False)
    for axes, result in itertools.zip_longest(grid.ravel(), results):
        axes.set_axis_off()
        if result:
            run, faults, title = result
            axes.set_title(_plain(title), fontsize=8, color=BAD if faults else GOOD)
            if run:
                _draw(axes, run, faults)
    figure.tight_layout()
    figure.savefig(str(file), dpi=80)
    plt.close(figure)


def _plain(title):
    """Without what matplotlib would take for a formula."""
    return title.replace("$", r"\$")


def _draw(axes, run, faults):
    for box in run.world.boxes:
        _box(axes, box, "#b8b8b4")
    for shape in run.world.scenery:
        if shape.round:
            axes.add_patch(Circle((shape.x, shape.y), shape.length / 2, facecolor=shape.colour, edgecolor="black"))
        elif shape.kind == "lines":
            _box(axes, shape, shape.colour)
    for x, y, yaw, size, number in run.world.tags:
        along, across = size / 2 * math.sin(yaw), size / 2 * math.cos(yaw)
        axes.plot((x - along, x + along), (y + across, y - across), color="black", linewidth=3)
        axes.annotate(f"{number}", (x + 0.15 * math.cos(yaw), y + 0.15 * math.sin(yaw)), ha="center", va="center")
    path = run.path
    axes.plot(path[:, 1], path[:, 2], color=WAY, linewidth=1.5)
    for second in range(0, int(path[-1, 0]) + 1, 5):
        row = path[np.argmax(path[:, 0] >= second)]
        axes.plot(row[1], row[2], ".", color=WAY)
        axes.annotate(f"{second} s", row[1:3], fontsize=7, xytext=(3, 3), textcoords="offset points")
    for pose, colour in ((path[0], "#7a7a7a"), (path[-1], BAD if faults else GOOD)):
        axes.add_patch(Circle(pose[1:3], run.radius, fill=False, edgecolor=colour))
        axes.plot(*[(at, at + run.radius * turn(pose[3])) for at, turn in zip(pose[1:3], (math.cos, math.sin))],
                  color=colour)
    for second, _ in faults:
        row = path[np.argmax(path[:, 0] >= min(second, path[-1, 0]))]
        axes.plot(row[1], row[2], "x", color=BAD, markersize=9)
    axes.set_aspect("equal", adjustable="datalim")


def _box(axes, box, colour):
    corner = (box.x - box.length / 2, box.y - box.width / 2)
    turn = Affine2D().rotate_around(box.x, box.y, box.yaw) + axes.transData
    axes.add_patch(Rectangle(corner, box.length, box.width, facecolor=colour, transform=turn))
    reach = max(box.length, box.width) / 2 * np.array([abs(math.cos(box.yaw)), abs(math.sin(box.yaw))])
    axes.plot(box.x + reach[0] * np.array([-1, 1]), box.y + reach[1] * np.array([-1, 1]), alpha=0)  # for the limits
