"""Command line of fast_drive: standard drives in the simulator without ROS, and the odometry's error on them."""

import argparse
import collections
import math
import sys
import time
from pathlib import Path

from robotont_calibration.arguments import numbers
from robotont_calibration.recording_files import write_csv
from robotont_calibration.standard_drives import DRIVES, PAUSE, REST
from robotont_driver.kinematics import se2
from robotont_driver.robots.robot_folder import read_wheel_file
from robotont_simulator.lockstep import LockstepRun
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World


def parse(arguments):
    """The options."""
    available = "\n".join(f"  {name}={default:g}  {what}" for name, (what, default, _) in DRIVES.items())
    as_it_is = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="fast_drive", formatter_class=as_it_is, description=(
        "Drives the simulated robot as fast as the machine allows, without ROS, and compares odometry with truth.\n"
        "The same seed gives the same run. Drives, each with its number and default:\n" + available))
    parser.add_argument("drives", nargs="*", metavar="DRIVE", type=read_drive,
                        default=[read_drive("square"), read_drive("square_clockwise")],
                        help="e.g. square, spin=-5; none: square square_clockwise (UMBmark)")
    parser.add_argument("--wheel-params", required=True, metavar="FILE", help="wheel_params.yaml of the robot")
    parser.add_argument("--believed", metavar="FILE", help=(
        "wheel_params.yaml that commands and odometry use instead, to see what wrong ones do"))
    parser.add_argument("--grip", metavar="WHEEL=PART", action="append", default=[], type=read_grip,
                        help="part 0 to 1 of the friction that a wheel has, e.g. 0=0.02")
    parser.add_argument("--seed", type=int, default=0, help="of everything random (default: %(default)s)")
    parser.add_argument("--csv", metavar="FOLDER", help="write each drive's packets and true poses there: "
                        "DRIVE.csv, and DRIVE_2.csv for the second of its name")
    return parser.parse_args(arguments)


def read_drive(text):
    """(name, number) of "name" or "name=number". Raises ArgumentTypeError."""
    name, _, number = text.partition("=")
    if name not in DRIVES:
        raise argparse.ArgumentTypeError(f"found drive {name!r}, allowed: {', '.join(DRIVES)}")
    what, default, _ = DRIVES[name]
    value, = numbers(number or str(default), 1, f"{name}=NUMBER, its {what}")
    if name.startswith("square") and value <= 0:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: {name}=NUMBER, its {what}, > 0")
    return name, value


def read_grip(text):
    """(wheel, part) of "wheel=part". Raises ArgumentTypeError."""
    allowed = "WHEEL=PART with a part from 0 to 1"
    wheel, part = numbers(text.replace("=", " "), 2, allowed)
    if wheel != int(wheel) or wheel < 0 or not 0 <= part <= 1:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: {allowed}")
    return int(wheel), part


def make_run(options):
    """A fresh robot at rest, a `LockstepRun`. Raises ValueError or OSError for a wrong file."""
    wheels = read_wheel_file(options.wheel_params)[0]
    believed = read_wheel_file(options.believed)[0] if options.believed else wheels
    if believed.amount != wheels.amount:
        raise ValueError(f"{options.believed}: found {believed.amount} wheels, allowed: {wheels.amount}, as in "
                         f"{options.wheel_params}")
    simulation = Simulation(wheels, World((), (0.0, 0.0, 0.0)), options.seed)
    for wheel, part in options.grip:
        if wheel >= wheels.amount:
            raise ValueError(f"found --grip of wheel {wheel}, allowed: 0 to {wheels.amount - 1}")
        simulation.set_grip(wheel, part)
    run = LockstepRun(simulation, believed)
    run.hold(REST, PAUSE)
    return run


def errors(run, start):
    """(forward [m], left [m], turn [rad]) of the odometry's end minus the true one, seen from the start."""
    believed, true = (se2.between(begin, end) for begin, end in zip(start[1:], run.path[-1][1:]))
    return believed[0] - true[0], believed[1] - true[1], se2.wrap(believed[2] - true[2])


def main(arguments=None):
    """Run; returns the exit status."""
    options = parse(arguments)
    seen = collections.Counter()
    try:
        for name, number in options.drives:
            seen[name] += 1
            run = make_run(options)
            start, begun = run.path[-1], time.perf_counter()
            run.drive(DRIVES[name][2](number, run.simulation.wheels.pid_frequency))
            speed = (run.simulation.time - start[0]) / (time.perf_counter() - begun)
            forward, left, turn = errors(run, start)
            print(f"{name + f'={number:g}':22} odometry minus truth: {1000 * forward:+8.1f} mm {1000 * left:+8.1f} mm "
                  f"{math.degrees(turn):+7.2f}°   {run.simulation.time:6.1f} s, {speed:.0f} x real time")
            if options.csv:
                Path(options.csv).mkdir(parents=True, exist_ok=True)
                write_csv(Path(options.csv) / (f"{name}_{seen[name]}.csv" if seen[name] > 1 else f"{name}.csv"),
                          [(at, counts) for (at, _, _), counts in zip(run.path, run.counts)],
                          [(at, truth) for at, _, truth in run.path])
    except (OSError, ValueError) as error:
        print(f"fast_drive: {error}", file=sys.stderr)
        return 1
    return 0
