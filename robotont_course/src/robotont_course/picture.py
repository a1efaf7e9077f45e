"""The picture of a run, from above: the world, the true way with its seconds, and what was wrong where."""

import itertools
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from robotont_driver.kinematics import se2

WAY, GOOD, BAD = "#1f4e79", "#2e7d32", "#b3261e"
COLUMNS = 5  # of a class's page, at most


def draw_class(results, file, size=3.0):
    """Write a PNG file with all runs of a class: (`judge.Run` or None, faults, title) of each; size: of one [inch]."""
    columns = min(max(1, len(results)), COLUMNS)
    rows = max(1, math.ceil(len(results) / columns))
    figure, grid = plt.subplots(rows, columns, figsize=(size * columns, 1.1 * size * rows), squeeze=False)
    for axes, result in itertools.zip_longest(grid.ravel(), results):
        axes.set(xlabel="x [m]", ylabel="y [m]")
        if len(results) > 1:
            axes.set_axis_off()
        if result:
            run, faults, title = result
            # a dollar would begin a formula of matplotlib's, and what is no Unicode would end it
            title = title.replace("$", r"\$").encode("utf-8", "replace").decode()
            axes.set_title(title, fontsize=8, wrap=True, color=BAD if faults else GOOD)
            if run:
                _draw(axes, run, faults)
    figure.tight_layout()
    figure.savefig(str(file), dpi=90)
    plt.close(figure)


def _draw(axes, run, faults):
    for shape in run.world.shapes:
        turns = np.linspace(0, 2 * np.pi, 37)
        x, y = (np.cos(turns), np.sin(turns)) if shape.round else np.array([(-1, 1, 1, -1), (-1, -1, 1, 1)])
        corners = se2.compose((shape.x, shape.y, shape.yaw), (x * shape.length / 2, y * shape.width / 2, 0.0))
        axes.fill(*corners[:2], facecolor=shape.colour, edgecolor="black" if shape.round else shape.colour)
    for x, y, yaw, _, number in run.world.tags:
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
