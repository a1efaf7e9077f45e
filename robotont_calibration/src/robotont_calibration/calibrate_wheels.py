"""Command line of calibrate_wheels: wheel parameters from recorded runs, or from runs that it guides through."""

import argparse
import math
import re
import sys
from pathlib import Path

from robotont_calibration.calibration import Stretch, Unknowns, calibrate, stretches_of
from robotont_calibration.calibration_report import Run, draw, table, whole_of
from robotont_calibration.recordings import read_recording
from robotont_driver.wheel_file import read_wheel_file, with_values

TRACKED = (0.002, math.radians(0.2))  # [m], [rad] what a ground truth's poses, and their stamps, may be off
TAPED = (0.003, math.radians(0.7))    # [m], [rad] what a tape and a ruler on the floor may be off
SECONDS = 2.0                         # [s] of a stretch of a run whose true pose is known all the way
WHEEL_NOISE = 0.001                   # [m] after 1 m, to begin with; the table tells what the runs really have


def parse(arguments):
    """The options."""
    parser = argparse.ArgumentParser(
        prog="calibrate_wheels", fromfile_prefix_chars="@",
        description="Finds wheelRadius, wheelDistanceFromCenter and wheelRads from runs whose true end is known, and "
                    "writes them to a new file. With --guide it says which runs to make, records them, and asks where "
                    "the robot stands after each.",
        epilog="A RUN is a .csv or .bag with a ground truth (columns x,y,yaw; --truth), or FILE=X,Y,YAW with the end "
               "as measured with a tape: [m] forward and left of the start, [degrees] turned, whole turns left aside. "
               "@FILE reads arguments from a file, one a line.")
    parser.add_argument("runs", nargs="*", metavar="RUN", help="recorded runs")
    parser.add_argument("--wheel-params", required=True, metavar="FILE", help="wheel_params.yaml to begin with")
    parser.add_argument("-o", "--output", default="wheel_params.calibrated.yaml", metavar="FILE",
                        help="default: %(default)s")
    parser.add_argument("--force", action="store_true", help="overwrite the output")
    parser.add_argument("--picture", default="calibration.png", metavar="PNG", help="default: %(default)s")
    parser.add_argument("--radius", choices=("common", "each", "fixed"), default="common",
                        help="one factor for all wheels, a radius for each, or as it is (default: %(default)s)")
    parser.add_argument("--distance", choices=("common", "fixed"), default="common", help="default: %(default)s")
    parser.add_argument("--angles", choices=("each", "fixed"), default="each", help="default: %(default)s")
    parser.add_argument("--truth", metavar="TOPIC", help="ground truth in bags, or while guiding")
    parser.add_argument("--packets", metavar="TOPIC", default="serial_read", help="default: %(default)s")
    guide = parser.add_argument_group("guided runs (a ROS master and a robot that runs)")
    guide.add_argument("--guide", metavar="FOLDER", help="make the runs now and keep them in this folder")
    guide.add_argument("--side", type=positive, default=2.0, metavar="M", help="of the squares (default: %(default)s)")
    guide.add_argument("--turns", type=positive, default=3.0, metavar="N",
                       help="on the spot; few, for nobody measures whole turns (default: %(default)s)")
    guide.add_argument("--line", type=positive, default=3.0, metavar="M", help="sideways (default: %(default)s)")
    options = parser.parse_args(arguments)
    if bool(options.guide) == bool(options.runs):
        parser.error("found " + ("--guide and recorded runs" if options.guide else "neither runs nor --guide")
                     + ", allowed: one of the two")
    return options


def positive(text):
    """A number > 0. Raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: a number > 0")
    return value


def read_run(text, wheels, topics):
    """`Run` of FILE or FILE=X,Y,YAW. Raises ValueError or OSError with what is wrong with it."""
    file, _, end = text.partition("=")
    recording = read_recording(file, topics)
    times, counts = recording.counts(wheels)
    name = Path(file).stem.replace("_", " ")
    if end:
        whole = Stretch(counts, read_end(end), TAPED)
        return Run(name, whole, [whole])
    truth = recording.trajectory("truth")
    if truth is None:
        raise ValueError(f"{file}: found no true pose, allowed: a ground truth, or {file}=X,Y,YAW with the end")
    stretches = stretches_of(times, counts, truth, SECONDS, TRACKED)
    return Run(name, whole_of(stretches, TRACKED), stretches)


def read_end(text):
    """(x [m], y [m], yaw [rad]) of X,Y,YAW in m, m and degrees. Raises ValueError."""
    fields = re.split(r"[,\s]+", text.strip())
    try:
        numbers = [float(field) for field in fields]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"found {text!r}, allowed: X,Y,YAW of the end, seen from the start [m, m, degrees]")
    return numbers[0], numbers[1], math.radians(numbers[2])


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    try:
        return run(options)
    except (OSError, ValueError) as error:
        print(f"calibrate_wheels: {error}", file=sys.stderr)
        return 1


def run(options):
    """Make or read the runs, calibrate, write and tell. Returns the exit status."""
    wheels, given, text = read_wheel_file(options.wheel_params)
    unknowns = Unknowns(given, options.radius, options.distance, options.angles)
    if Path(options.output).exists() and not options.force:
        raise ValueError(f"{options.output}: exists; --force overwrites it, -o names another")
    if options.guide:
        from robotont_calibration.calibration_guide import guide  # here, for recorded runs need no ROS

        options.runs = guide(options, wheels)
    topics = {"truth": options.truth, "packets": options.packets}
    runs = [read_run(recorded, wheels, topics) for recorded in options.runs]
    found = calibrate(given, [stretch for each in runs for stretch in each.stretches], unknowns, WHEEL_NOISE)
    print(table(given, found, runs))
    for name in found.undetermined:
        print(f"warning: these runs do not determine {name}: it stays near its old value; "
              "squares both ways, turns on the spot and straight lines with an end of their own do", file=sys.stderr)
    note = "Made by calibrate_wheels from " + ", ".join(each.name for each in runs) + "."
    Path(options.output).write_text(with_values(text, found.parameters, note))
    draw(options.picture, given, found, runs)
    print(f"\nparameters: {options.output}\npicture: {options.picture}")
    return 0
