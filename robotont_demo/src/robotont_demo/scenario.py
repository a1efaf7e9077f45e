"""The demo's drive, a square without turning, then a circle with one turn the other way; its picture. Free of ROS."""

import math
from typing import NamedTuple, Tuple

import numpy as np
from matplotlib.figure import Figure

from robotont_driver.kinematics import se2

PERIOD = 0.02             # [s] between commands
SIDE, RADIUS = 1.0, 0.5   # [m] of the square, of the circle
ACCELERATION = 1.0        # [m/s^2] within the driver's limit, so that the robot does just as commanded
SIDES = (("forward", 1, 0), ("left", 0, 1), ("back", -1, 0), ("right", 0, -1))


class Step(NamedTuple):
    """One period of the drive."""

    leg: str                            # name of the part that it belongs to
    twist: Tuple[float, float, float]   # v_x, v_y [m/s], omega [rad/s]


def plan(speed):
    """List of the Steps from start to end, at a speed [m/s]; each leg begins and ends with ACCELERATION."""
    square = [Step(f"square, {name}", (x * now, y * now, 0.0))
              for name, x, y in SIDES for now in trapezium(SIDE, speed)]
    speeds = trapezium(2 * math.pi * RADIUS, speed)
    angles = (np.cumsum(speeds) - speeds / 2) * PERIOD / RADIUS  # in the middle of each period
    # seen from the robot the direction goes round twice, because the robot turns once the other way
    circle = [Step("circle, turning", (now * math.cos(2 * angle), now * math.sin(2 * angle), -now / RADIUS))
              for now, angle in zip(speeds.tolist(), angles.tolist())]
    return square + circle


def trapezium(length, speed):
    """Speeds [m/s] per period, up with ACCELERATION and down again, that cover exactly `length` [m]."""
    ramp = np.arange(PERIOD / 2, speed / ACCELERATION, PERIOD) * ACCELERATION
    hold = round((length - speed ** 2 / ACCELERATION) / speed / PERIOD)
    speeds = np.concatenate([ramp, np.full(hold, speed), ramp[::-1]])
    return speeds * (length / (speeds.sum() * PERIOD))


def commanded_path(steps):
    """K+1 x 2 places [m] of a robot that follows K Steps exactly, from the origin."""
    poses = se2.path([[speed * PERIOD for speed in step.twist] for step in steps])
    return np.vstack([np.zeros(2), poses[:, :2]])


def errors_of(estimate, reference):
    """(distances [m] K, headings [rad] K, within half a turn) between two `Trajectory` at the same times."""
    x, y, yaw = (estimate.poses - reference.poses).T
    return np.hypot(x, y), np.abs(se2.wrap(yaw))


def draw(path, title, estimate, reference, commanded, allowed):
    """Write a PNG: the paths, and the errors over time. commanded: K x 2 places [m]; allowed: error [m] at the end."""
    figure = Figure(figsize=(11, 5.2), constrained_layout=True)
    figure.suptitle(title)
    paths, errors = figure.subplots(1, 2)
    for places, colour, width, name in ((reference.poses.T, "silver", 6, "ground truth"),
                                        (estimate.poses.T, "tab:blue", 1.5, "odometry"),
                                        (commanded.T, "black", 0.5, "commanded")):
        paths.plot(*places[:2], color=colour, linewidth=width, label=name)
    paths.set(title="Path", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    times, (places, headings) = reference.times - reference.times[0], errors_of(estimate, reference)
    errors.plot(times, 1000 * places, label="place [mm]")
    errors.plot(times, 10 * np.degrees(headings), label="heading [0.1°]")
    errors.axhline(1000 * allowed, color="black", linestyle=":", label="allowed at the end [mm]")
    errors.set(title="Errors of the odometry", xlabel="time [s]")
    for axes in (paths, errors):
        axes.legend()
    figure.savefig(str(path), dpi=110)
