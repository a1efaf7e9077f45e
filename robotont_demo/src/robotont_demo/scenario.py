"""The demo's drive, a square without turning, then a circle with the back to its middle; its picture. Free of ROS."""

import math

import numpy as np
from matplotlib.figure import Figure

from robotont_calibration.standard_drives import driven
from robotont_driver.kinematics import se2

PERIOD = 0.02             # [s] between commands
SIDE, RADIUS = 1.0, 0.5   # [m] of the square, of the circle
LEGS = ((SIDE, 0.0, 0.0), (0.0, SIDE, 0.0), (-SIDE, 0.0, 0.0), (0.0, -SIDE, 0.0),
        (0.0, 2 * math.pi * RADIUS, 2 * math.pi))  # as `driven` takes them


def plan(speed):
    """Twists (v_x [m/s], v_y [m/s], omega [rad/s]) of the drive at a speed [m/s], one per period."""
    return list(driven(LEGS, 1 / PERIOD, speed))


def errors_of(estimate, reference):
    """(distances [m] K, headings [rad] K, within half a turn) between two `Trajectory` at the same times."""
    x, y, yaw = (estimate.poses - reference.poses).T
    return np.hypot(x, y), np.abs(se2.wrap(yaw))


def draw(path, title, estimate, reference, allowed):
    """Write a PNG of two `Trajectory`: the paths, and the errors over time. allowed: error [m] at the end."""
    figure = Figure(figsize=(11, 5.2), constrained_layout=True)
    figure.suptitle(title)
    paths, errors = figure.subplots(1, 2)
    paths.plot(*reference.poses.T[:2], color="silver", linewidth=6, label="ground truth")
    paths.plot(*estimate.poses.T[:2], label="odometry")
    paths.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    times, (places, headings) = reference.times - reference.times[0], errors_of(estimate, reference)
    errors.plot(times, 1000 * places, label="place [mm]")
    errors.plot(times, 10 * np.degrees(headings), label="heading [0.1°]")
    errors.axhline(1000 * allowed, color="black", linestyle=":", label="allowed at the end [mm]")
    errors.set(title="Errors of the odometry", xlabel="time [s]")
    paths.set_title("Path", loc="left")
    paths.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=2, frameon=False)  # beside the title: no way below
    errors.legend()
    figure.savefig(str(path), dpi=110)
