"""Command line of odometry_report: how far odometry is from the truth, as a table and a picture."""

import argparse
import sys
from pathlib import Path

import numpy as np

from robotont_calibration.arguments import coordinates, positive
from robotont_calibration.recording_files import FORMATS, read_recording
from robotont_calibration.recordings import RecordingError
from robotont_calibration.trajectory import Trajectory, write_tum
from robotont_calibration.trajectory_errors import Report
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


def make_report(recording, options):
    """`Report` of a recording. Raises RecordingError when it lacks what is needed."""
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
    times = [at for at, _ in recording.packets]
    return Report(estimate, reference, named, times, recording.refused, options.delta)


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    topics = {"odometry": options.odom, "truth": options.truth,
              "packets": options.packets, "commands": options.commands}
    try:
        report = make_report(read_recording(options.recording, topics, options.format), options)
        print(report.table())
        report.draw(options.output, f"Odometry against {report.named}: {options.recording}")
        if options.tum:
            Path(options.tum).mkdir(parents=True, exist_ok=True)
            write_tum(str(Path(options.tum) / "reference.tum"), report.reference)
            write_tum(str(Path(options.tum) / "odometry.tum"), report.estimate)
    except (ValueError, OSError) as error:
        print(f"odometry_report: {error}", file=sys.stderr)
        return 1
    print(f"picture: {options.output}")
    return 0
