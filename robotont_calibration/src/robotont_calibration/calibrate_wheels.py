"""Command line of calibrate_wheels: wheel parameters from recorded runs, or from runs that it guides through."""

import argparse
import contextlib
import sys
from pathlib import Path

import numpy as np
import yaml

from robotont_calibration.calibration_report import table
from robotont_calibration.calibration_runs import read_end, taped_run, tracked_run, turns
from robotont_calibration.free_parameters import FreeParameters
from robotont_calibration.next_run import next_run
from robotont_calibration.recordings import read_recording
from robotont_calibration.true_poses import implausible, wrong_yaw
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.parameters.files import write_file
from robotont_driver.robots.robot_folder import read_wheel_file

NOWHERE = (0.0, 0.0)  # [m] the default measured point: the robot's middle
DOUBTFUL = 3          # exit status of a calibration with a warning, and ...
USELESS = 4           # ... of one that is not written


def positive(text):
    """A number > 0, at most 1e6. Raises ArgumentTypeError."""
    with contextlib.suppress(ValueError):
        if 0 < float(text) <= 1e6:
            return float(text)
    raise argparse.ArgumentTypeError(f"found {text!r}, allowed: a number > 0, at most 1e6")


def parse(arguments):
    """The options."""
    parser = argparse.ArgumentParser(
        prog="calibrate_wheels", fromfile_prefix_chars="@",
        description="Finds wheelRadius, wheelDistanceFromCenter and wheelRads from runs whose true end is known, and "
                    "writes them to a new file. With --guide it announces each run, records it, and asks where "
                    "the robot stands after it.",
        epilog="A RUN is a bag with a ground truth (--truth), or BAG=X,Y,YAW with the end as measured with a tape: [m] "
               "forward and left of the start, [degrees] turned, modulo full turns. "
               "@FILE reads arguments from a file, one a line. "
               f"Exit status: 0; {DOUBTFUL} with a warning; {USELESS} where the result is of no use and is not "
               "written; 1 or 2 where something was wrong.")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("runs", nargs="*", default=[], metavar="RUN", help="recorded runs")
    source.add_argument("--guide", metavar="FOLDER", help="make the runs now and keep them in this folder")
    parser.add_argument("--wheel-params", required=True, metavar="FILE", help="wheel_params.yaml to begin with")
    parser.add_argument("-o", "--output", default="wheel_params.calibrated.yaml", metavar="FILE",
                        help="default: %(default)s")
    parser.add_argument("--force", action="store_true", help="overwrite the output")
    parser.add_argument("--angles", choices=("each", "fixed"), default="each",
                        help="fixed: the directions stay, and the radii get one factor (default: %(default)s)")
    parser.add_argument("--truth", metavar="TOPIC", help="ground truth")
    parser.add_argument("--packets", metavar="TOPIC", default="serial_read", help="default: %(default)s")
    guide = parser.add_argument_group("guided runs (a ROS master and a running robot)")
    guide.add_argument("--side", type=positive, default=2.0, metavar="M", help="of the squares (default: %(default)s)")
    guide.add_argument("--turns", type=positive, default=3.0, metavar="N",
                       help="on the spot; keep it small: whole turns cannot be measured (default: %(default)s)")
    guide.add_argument("--line", type=positive, default=3.0, metavar="M", help="sideways (default: %(default)s)")
    return parser.parse_args(arguments)


def read_run(text, wheels, topics):
    """`Run` of FILE or FILE=X,Y,YAW. Raises ValueError or OSError with what is wrong with it."""
    file, _, end = text.partition("=")
    name = Path(file).stem.replace("_", " ")
    recording = read_recording(file, {**topics, "truth": None} if end else topics)
    times, counts = recording.counts(wheels)
    if end:
        run = taped_run(name, counts, read_end(end))
    else:
        try:
            truth = recording.trajectory(
                "truth", f"found no true pose, allowed: one (--truth TOPIC), or {file}=X,Y,YAW with the end")
            run = tracked_run(name, times, counts, truth)
        except ValueError as error:
            raise ValueError(f"{file}: {error}") from None
    gaps = np.diff(times)
    missing = np.maximum(np.round(gaps * wheels.pid_frequency) - 1, 0).sum()
    return run._replace(missing=int(missing), longest_gap=float(gaps.max(initial=0.0)))


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    try:
        return run(options)
    except EOFError:
        error = "found the end of the input, allowed: an answer"
    except (OSError, ValueError) as found:
        error = found
    print(f"calibrate_wheels: {error}", file=sys.stderr)
    return 1


def run(options):
    """Make or read the runs, calibrate, write and report. Returns the exit status."""
    wheels, given, _ = read_wheel_file(options.wheel_params)
    if Path(options.output).exists() and not options.force:
        raise ValueError(f"{options.output}: exists; --force overwrites it, -o names another")
    if options.guide:
        from robotont_calibration.calibration_guide import guide  # here, for it takes half a second

        options.runs = guide(options, wheels)
    topics = {"truth": options.truth, "packets": options.packets}
    runs = [read_run(recorded, wheels, topics) for recorded in options.runs]
    found = choose(options, given, runs)
    print(table(given, found, runs))
    spoilt = contradictions(runs, found)
    warnings = doubts(found) + spoilt
    for words in warnings:
        print(f"warning: {words}", file=sys.stderr)
    advice = next_run(found, options.side, options.turns, options.line)
    if advice:
        name, before, after = advice
        print(f"\nnext: {name}. Of all runs this one is the most informative: the error expected of the parameters, at "
              f"the end of such drives,\nfalls from {1000 * before:.0f} to {1000 * after:.0f} mm.", flush=True)
    if spoilt:
        print("calibrate_wheels: nothing is written; use none of these values", file=sys.stderr)
        return USELESS
    values = dict(found.parameters)
    for key in ("wheelRadius", "wheelDistanceFromCenter", "wheelRads"):
        values[key] = np.round(values[key], 7).tolist()  # to a tenth of a micrometre or microradian
    if "measuredPoint" in given or found.point != NOWHERE:
        values["measuredPoint"] = np.round(found.point, 4).tolist()
    write_file(options.output, (
        f"# Made by calibrate_wheels from {', '.join(each.name for each in runs)}.\n"
        f"# What the keys mean, in which units: config/wheel_params.yaml. Before: {options.wheel_params}\n"
        + yaml.safe_dump(values, sort_keys=False, default_flow_style=None)))
    print(f"parameters: {options.output}")
    return DOUBTFUL if warnings else 0


def doubts(found):
    """Warnings about what the runs of a `Calibration` leave open."""
    words = []
    if found.undetermined:
        words.append(f"these runs do not determine {', '.join(found.undetermined)}, kept near the old values; squares "
                     "both ways, turns on the spot and straight lines with an end of their own do")
    words += [f"{name} disagrees with the other runs and counts less; bumped, or measured wrongly?"
              for name in found.outlying]
    return words


def contradictions(runs, found):
    """Reasons why the `Calibration` of these runs may be worse than the file that there is."""
    words = wrong_yaw(runs, found.free)[:1]
    if words:
        return words  # the reason; what follows would be its consequences
    words = implausible(found)
    if {name for name in found.free.names if not name.startswith("point")} <= set(found.undetermined):
        words.append("these runs determine nothing of the wheels")
    return words


def choose(options, given, runs):
    """`Calibration` by the options; of what they leave open, what the runs make likelier."""
    where = "free" if turns(runs) else tuple(given.get("measuredPoint", NOWHERE))
    radii = ("common", "each") if options.angles == "each" else ("common",)  # an angle that is off would pass for radii
    models = [FreeParameters(given, radius, options.angles, where) for radius in radii]
    return min((calibrate(runs, free) for free in models), key=lambda found: found.unlikely)
