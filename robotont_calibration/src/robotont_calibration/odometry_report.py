"""Command line of odometry_report: how far odometry is from the truth, as a table and a picture.

The measures are those of J. Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012), on the
plane, with evo's stretches; evo itself needs a newer numpy than ROS Noetic's.
"""

import argparse
import math
import sys

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from robotont_calibration.arguments import numbers, positive
from robotont_calibration.recordings import read_recording
from robotont_calibration.trajectory import Trajectory, seen_from, synchronise
from robotont_driver.kinematics import se2
from robotont_driver.robots.robot_folder import read_wheel_file

BLUE, GREY = "#2f6db3", "#a5abb3"  # odometry, ground truth
ARROWS = 30  # of the heading, along the path
STYLE = {"font.size": 9, "axes.grid": True, "grid.color": "#e6e8eb", "axes.axisbelow": True}  # of matplotlib


def parse(arguments):
    """The options."""
    parser = argparse.ArgumentParser(prog="odometry_report", description=(
        "Compares odometry with a ground truth: a table and a picture. Their starts are laid over each other. Reads a "
        "bag, without a ROS master. evo reads the same bags (evo_ape bag BAG TRUTH ODOM)."))
    parser.add_argument("recording", help="a bag, as of rosbag record -a")
    parser.add_argument("--odom", metavar="TOPIC", default="odom", help="odometry (default: %(default)s)")
    parser.add_argument("--truth", metavar="TOPIC", help=(
        "ground truth: nav_msgs/Odometry, geometry_msgs/PoseStamped or PoseWithCovarianceStamped"))
    parser.add_argument("--packets", metavar="TOPIC", default="serial_read", help="packets (default: %(default)s)")
    parser.add_argument("--wheel-params", metavar="FILE",
                        help="recompute the odometry from the packets, with this wheel_params.yaml")
    parser.add_argument("--point", type=lambda text: numbers(text, 2, "X,Y [m]"), metavar="X,Y", help=(
        "which point of base_link the ground truth is of [m] (default: measuredPoint of the wheel_params.yaml, as "
        "calibrate_wheels writes it; without: the middle)"))
    parser.add_argument("--delta", type=positive, default=1.0, metavar="M",
                        help="stretch of path for relative errors [m] (default: %(default)s)")
    parser.add_argument("-o", "--output", default="odometry_report.png", metavar="PNG", help="default: %(default)s")
    return parser.parse_args(arguments)


def compared(recording, options):
    """(odometry, ground truth): two `Trajectory` at the same times. Raises ValueError when something lacks."""
    point = options.point or (0.0, 0.0)
    if options.wheel_params:
        wheels, given, _ = read_wheel_file(options.wheel_params)
        estimate, point = recording.recomputed(wheels), options.point or given.get("measuredPoint", point)
    else:
        estimate = recording.trajectory(
            "odometry", f"found no odometry on {options.odom}; with --wheel-params it is computed from packets")
    reference = recording.trajectory("truth", "found no ground truth, allowed: --truth TOPIC")
    estimate = Trajectory(estimate.times, np.transpose(se2.compose(estimate.poses.T, (*point, 0.0))))
    return synchronise(estimate, reference)


def rows(estimate, reference, delta=1.0):
    """[(what, value with unit)] of the table, of two `Trajectory` at the same times. delta: [m] of relative errors."""
    errors, length = estimate.poses - reference.poses, reference.steps.sum()
    places, turned = sizes(errors)[0], np.abs(np.diff(reference.poses[:, 2])).sum() / (2 * math.pi)
    end, end_turn = places[-1], math.degrees(abs(errors[-1, 2]))  # whole turns count
    stretches = relative_errors(estimate, reference, delta)
    return [
        ("duration", f"{reference.times[-1] - reference.times[0]:.1f} s"),
        ("path of the ground truth", f"{length:.2f} m"),
        ("turned, to and fro", f"{turned:.2f} turns"),
        ("absolute error, root mean square", root_mean_squares(errors)),
        ("absolute error, largest", f"{1000 * places.max():.1f} mm"),
        (f"relative error per {delta:g} m, root mean square",
         root_mean_squares(stretches) if len(stretches) else f"path shorter than two of {delta:g} m: --delta"),
        ("error at the end", f"{1000 * end:.1f} mm, {end_turn:.2f}°"),
        ("drift per metre", f"{1000 * end / length:.1f} mm" if length else "no path"),
        ("drift per turn", f"{end_turn / turned:.2f}°" if turned > 0.25 else "too few turns"),
    ]


def sizes(errors):
    """(distances [m], headings [rad], within half a turn) of K x 3 errors of poses."""
    return np.hypot(errors[:, 0], errors[:, 1]), np.abs(se2.wrap(errors[:, 2]))


def root_mean_squares(errors):
    """The text for the table, of K x 3 errors of poses."""
    place, heading = (np.sqrt(np.mean(values ** 2)) for values in sizes(errors))
    return f"{1000 * place:.1f} mm, {math.degrees(heading):.2f}°"


def relative_errors(estimate, reference, delta):
    """K x 3 errors of the motion over consecutive stretches of `delta` [m] of the reference's path, as of evo_rpe.

    From one pose at which another `delta` was complete to the next. None where the path is shorter than two.
    """
    marks, gone = [], 0.0
    for index, step in enumerate(reference.steps, 1):
        gone += step
        if gone >= delta:
            marks.append(index)
            gone = 0.0
    moved, believed = (seen_from(one.poses[marks[:-1]], one.poses[marks[1:]]) for one in (reference, estimate))
    return seen_from(moved, believed)


def draw(path, title, estimate, reference, commanded=None, allowed=None):
    """Write a PNG: the paths, the odometry's with arrows of its heading, and the errors of place and heading over time.

    commanded: K x 2 places [m], None for none; allowed: error [m] at the end, None for none.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(11, 5.2), constrained_layout=True)
        figure.suptitle(title, x=0.01, ha="left", fontsize=12)
        paths, errors = figure.subplots(1, 2)
        paths.plot(*reference.poses.T[:2], color=GREY, label="ground truth", linewidth=6)
        paths.plot(*estimate.poses.T[:2], color=BLUE, label="odometry", linewidth=1.5)
        x, y, yaw = estimate.poses[::len(estimate.poses) // ARROWS + 1].T
        paths.quiver(x, y, np.cos(yaw), np.sin(yaw), color=BLUE, width=0.004, scale=25, zorder=3)
        if commanded is not None:
            paths.plot(*commanded.T, color="black", label="commanded", linewidth=1, linestyle=(0, (4, 3)), zorder=4)
        paths.set(title="Path", xlabel="x [m]", ylabel="y [m]")
        paths.set_aspect("equal", adjustable="datalim")
        paths.legend()
        places, headings = sizes(estimate.poses - reference.poses)
        times = reference.times - reference.times[0]
        errors.plot(times, 1000 * places, color=BLUE, label="place [mm]")
        errors.plot(times, 10 * np.degrees(headings), color=GREY, label="heading [0.1°]")
        if allowed is not None:
            errors.axhline(1000 * allowed, color="black", linestyle=":", label="allowed at the end [mm]")
        errors.set(title="Errors", xlabel="time [s]", ylim=(0, None))
        errors.legend()
        figure.savefig(str(path), dpi=110)


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    topics = {"odometry": options.odom, "truth": options.truth, "packets": options.packets}
    try:
        recording = read_recording(options.recording, topics)
        estimate, reference = compared(recording, options)
        for what, value in (*rows(estimate, reference, options.delta), ("packets refused", recording.refused)):
            print(f"{what:42}  {value}")
        draw(options.output, f"Odometry against ground truth: {options.recording}", estimate, reference)
    except (ValueError, OSError) as error:
        print(f"odometry_report: {error}", file=sys.stderr)
        return 1
    print(f"picture: {options.output}")
    return 0
