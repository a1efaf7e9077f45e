"""Command line of odometry_report: how far odometry is from the truth, as a table and a picture.

The measures are those of J. Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012), on the
plane, with evo's stretches; evo itself needs a newer numpy than ROS Noetic's.
"""

import argparse
import math
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from robotont_calibration.arguments import coordinates, positive
from robotont_calibration.recording_files import FORMATS, read_recording
from robotont_calibration.recordings import RecordingError
from robotont_calibration.trajectory import BLUE, GREY, STYLE, Trajectory, seen_from, synchronise, write_tum
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.robots.robot_folder import read_wheel_file


def parse(arguments):
    """The options."""
    parser = argparse.ArgumentParser(prog="odometry_report", description=(
        "Compares odometry with a ground truth, or without one with the commanded path: a table, a picture, "
        "and files for evo. Their starts are laid over each other. Reads a bag or a CSV of packets, without a ROS "
        "master."))
    parser.add_argument("recording", help="a .bag file, as of rosbag record -a, or a .csv")
    parser.add_argument("--odom", metavar="TOPIC", default="odom", help="odometry (default: %(default)s)")
    parser.add_argument("--truth", metavar="TOPIC", help=(
        "ground truth: nav_msgs/Odometry, geometry_msgs/PoseStamped or PoseWithCovarianceStamped"))
    parser.add_argument("--commands", metavar="TOPIC", default="cmd_vel", help="commands (default: %(default)s)")
    parser.add_argument("--packets", metavar="TOPIC", default="serial_read", help="packets (default: %(default)s)")
    parser.add_argument("--wheel-params", metavar="FILE",
                        help="recompute the odometry from the packets, with this wheel_params.yaml")
    parser.add_argument("--point", type=coordinates, metavar="X,Y", help=(
        "which point of base_link the ground truth is of [m] (default: measuredPoint of the wheel_params.yaml, as "
        "calibrate_wheels writes it; without: the middle)"))
    parser.add_argument("--format", choices=FORMATS, default="auto",
                        help="of the recording: by its name, or a run of the OptiOdom data set (default: %(default)s)")
    parser.add_argument("--delta", type=positive, default=1.0, metavar="M",
                        help="stretch of path for relative errors [m] (default: %(default)s)")
    parser.add_argument("-o", "--output", default="odometry_report.png", metavar="PNG", help="default: %(default)s")
    parser.add_argument("--tum", metavar="FOLDER", help="also write reference.tum and odometry.tum for evo there")
    return parser.parse_args(arguments)


def compared(recording, options):
    """(odometry, reference, its name): two `Trajectory` at the same times. Raises ValueError when something lacks."""
    point = options.point or (0.0, 0.0)
    if options.wheel_params:
        wheels, given, _ = read_wheel_file(options.wheel_params)
        estimate, point = recording.recomputed(Kinematics(wheels)), options.point or given.get("measuredPoint", point)
    else:
        estimate = recording.trajectory("odometry")
        if estimate is None:
            raise RecordingError(
                f"found no odometry on {options.odom}; with --wheel-params it is computed from packets")
    reference, named = recording.trajectory("truth"), "ground truth"
    if reference is not None:
        estimate = Trajectory(estimate.times, np.transpose(se2.compose(estimate.poses.T, (*point, 0.0))))
    else:
        reference, named = recording.commanded_path(), "commanded path"
    if reference is None:
        raise RecordingError(
            f"found neither a ground truth (--truth) nor commands on {options.commands} to compare with")
    return (*synchronise(estimate, reference), named)


def rows(estimate, reference, named="ground truth", delta=1.0):
    """[(what, value with unit)] of the table, of two `Trajectory` at the same times. delta: [m] of relative errors."""
    errors, length = estimate.poses - reference.poses, reference.steps.sum()
    places, turned = sizes(errors)[0], np.abs(np.diff(reference.poses[:, 2])).sum() / (2 * math.pi)
    end, end_turn = places[-1], math.degrees(abs(errors[-1, 2]))  # whole turns count
    stretches = relative_errors(estimate, reference, delta)
    return [
        ("duration", f"{reference.times[-1] - reference.times[0]:.1f} s"),
        ("path of the ground truth" if named == "ground truth" else named, f"{length:.2f} m"),
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


def timing(times, numbers=()):
    """The text for the table: when packets came, of K >= 2 rising stamps [s]; by their K numbers, where they have some.

    Numbers that go back begin anew: of a board that has restarted nobody knows what is missing.
    """
    periods = np.diff(times)
    median = np.median(periods)
    if len(numbers) and None not in numbers:
        missing, what = np.maximum(np.diff(numbers) - 1, 0).sum(), "missing"
    else:
        missing, what = np.maximum(np.round(periods / median) - 1, 0).sum() if median > 0 else 0, "missing or late"
    return (f"{len(times)} at {1 / np.mean(periods):.1f}/s, {missing:.0f} {what}; {1000 * median:.1f} ms between two, "
            f"at most {1000 * periods.max():.0f} ms")


def draw(path, title, estimate, reference, named):
    """Write a PNG: both paths, and the errors of place and heading over time."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(10, 4.6), constrained_layout=True)
        figure.suptitle(title, x=0.01, ha="left", fontsize=12)
        paths, errors = figure.subplots(1, 2)
        for one, colour, label, width in ((reference, GREY, named, 3.2), (estimate, BLUE, "odometry", 1.5)):
            paths.plot(one.poses[:, 0], one.poses[:, 1], color=colour, label=label, linewidth=width)
        paths.set(title="Path", xlabel="x [m]", ylabel="y [m]")
        paths.set_aspect("equal", adjustable="datalim")
        paths.legend()
        places, headings = sizes(estimate.poses - reference.poses)
        times = reference.times - reference.times[0]
        errors.plot(times, 1000 * places, color=BLUE, label="place [mm]")
        errors.plot(times, 10 * np.degrees(headings), color=GREY, label="heading [0.1°]")
        errors.set(title="Errors", xlabel="time [s]", ylim=(0, None))
        errors.legend()
        figure.savefig(str(path))


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    topics = {"odometry": options.odom, "truth": options.truth,
              "packets": options.packets, "commands": options.commands}
    try:
        recording = read_recording(options.recording, topics, options.format)
        estimate, reference, named = compared(recording, options)
        found = rows(estimate, reference, named, options.delta)
        if len(recording.packets) > 1:
            found += [("packets", timing([at for at, _ in recording.packets],
                                         [getattr(packet, "number", None) for _, packet in recording.packets])),
                      ("packets refused", str(recording.refused))]
        print("\n".join(f"{what:42}  {value}" for what, value in found))
        draw(options.output, f"Odometry against {named}: {options.recording}", estimate, reference, named)
        if options.tum:
            Path(options.tum).mkdir(parents=True, exist_ok=True)
            for name, one in (("reference", reference), ("odometry", estimate)):
                write_tum(str(Path(options.tum) / f"{name}.tum"), one)
    except (ValueError, OSError) as error:
        print(f"odometry_report: {error}", file=sys.stderr)
        return 1
    print(f"picture: {options.output}")
    return 0
