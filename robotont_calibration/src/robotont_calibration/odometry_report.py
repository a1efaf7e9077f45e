"""Command line of odometry_report: how far a bag's odometry is from the truth, by evo: a table and a picture."""

import argparse
import math
import sys

import numpy as np
from evo import EvoException
from evo.core.metrics import APE, RPE, PoseRelation, StatisticsType, Unit
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import plot
from matplotlib.figure import Figure

from robotont_calibration.recordings import read_recording
from robotont_calibration.trajectory import synchronise
from robotont_driver.robots.robot_folder import read_wheel_file

PARTS = (PoseRelation.translation_part, PoseRelation.rotation_angle_deg)


def parse(arguments):
    """The options."""
    parser = argparse.ArgumentParser(prog="odometry_report", description=(
        "Compares a bag's odometry with its ground truth, laid on each other's start: a table and a picture. "
        "evo reads the same bag (evo_ape bag BAG TRUTH ODOM --align_origin)."))
    parser.add_argument("recording", help="a bag, as of rosbag record -a")
    parser.add_argument("--odom", metavar="TOPIC", default="odom", help="odometry (default: %(default)s)")
    parser.add_argument("--truth", metavar="TOPIC", help=(
        "ground truth: nav_msgs/Odometry, geometry_msgs/PoseStamped or PoseWithCovarianceStamped"))
    parser.add_argument("--packets", metavar="TOPIC", default="serial_read", help="packets (default: %(default)s)")
    parser.add_argument("--wheel-params", metavar="FILE", help=(
        "recompute the odometry from the packets, with this wheel_params.yaml, of its measuredPoint if it has one"))
    parser.add_argument("-o", "--output", default="odometry_report.png", metavar="PNG", help="default: %(default)s")
    return parser.parse_args(arguments)


def compared(recording, options):
    """(odometry, ground truth): two `Trajectory` at the same times. Raises ValueError when something lacks."""
    if options.wheel_params:
        wheels, given, _ = read_wheel_file(options.wheel_params)
        estimate = recording.recomputed(wheels, given.get("measuredPoint", (0.0, 0.0)))
    else:
        estimate = recording.trajectory(
            "odometry", f"found no odometry on {options.odom}; with --wheel-params it is computed from packets")
    return synchronise(estimate, recording.trajectory("truth", "found no ground truth, allowed: --truth TOPIC"))


def for_evo(trajectory):
    """A `Trajectory` as evo has it."""
    x, y, yaw = trajectory.poses.T
    turned = np.column_stack([np.cos(yaw / 2), 0 * x, 0 * x, np.sin(yaw / 2)])
    return PoseTrajectory3D(np.column_stack([x, y, 0 * x]), turned, trajectory.times)


def judged(pair, measure, *arguments):
    """(errors of place [m], words on the root mean squares) by evo's `measure`, APE or RPE, of (truth, odometry)."""
    place, heading = (measure(part, *arguments) for part in PARTS)
    place.process_data(pair)
    heading.process_data(pair)
    metres, degrees = (one.get_statistic(StatisticsType.rmse) for one in (place, heading))
    return place.error, f"{1000 * metres:.1f} mm, {degrees:.2f}°"


def report(estimate, reference):
    """([(what, value with unit)] for the table, the picture) of two `Trajectory` at the same times."""
    pair, xy = (for_evo(reference), for_evo(estimate)), plot.PlotMode.xy
    places, absolute = judged(pair, APE)
    try:
        _, relative = judged(pair, RPE, 1.0, Unit.meters)
    except EvoException:
        relative = "path shorter than two of 1 m"
    length, turned = pair[0].path_length, np.abs(np.diff(reference.poses[:, 2])).sum() / (2 * math.pi)
    end_turn = math.degrees(abs(estimate.poses[-1, 2] - reference.poses[-1, 2]))  # whole turns count
    figure = Figure(figsize=(8, 7))
    axes = plot.prepare_axis(figure, xy)
    plot.traj(axes, xy, pair[0], "--", "grey", "ground truth")
    plot.traj_colormap(axes, pair[1], places, xy, 0.0, places.max(), f"Odometry, by its error [m]: {absolute}", figure)
    return (
        ("ground truth", f"{np.ptp(reference.times):.1f} s, {length:.2f} m, {turned:.2f} turns, both ways added"),
        ("absolute error, root mean square", absolute),
        ("absolute error, largest", f"{1000 * places.max():.1f} mm"),
        ("relative error per 1 m, root mean square", relative),
        ("error at the end", f"{1000 * places[-1]:.1f} mm, {end_turn:.2f}°"),
        ("drift per metre", f"{1000 * places[-1] / length:.1f} mm" if length else "no path"),
        ("drift per turn", f"{end_turn / turned:.2f}°" if turned > 0.25 else "too few turns"),
    ), figure


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    topics = {"odometry": options.odom, "truth": options.truth, "packets": options.packets}
    try:
        recording = read_recording(options.recording, topics)
        rows, figure = report(*compared(recording, options))
        for what, value in (*rows, ("packets", len(recording.packets) or f"none on {options.packets}"),
                            ("packets and poses refused", recording.refused)):
            print(f"{what:42}  {value}")
        figure.savefig(options.output, dpi=110)
    except (ValueError, OSError) as error:
        print(f"odometry_report: {error}", file=sys.stderr)
        return 1
    print(f"picture: {options.output}")
    return 0
