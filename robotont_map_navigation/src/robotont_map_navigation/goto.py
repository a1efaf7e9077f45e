"""The command goto: sends the robot to a place, shows progress, and its exit status is the outcome."""

import argparse
import contextlib
import functools
import re
import signal

import rospy

from robotont_map_navigation.goal import Goal, Outcome, Status
from robotont_map_navigation.goto_client import PATIENCE, GoTo
from robotont_map_navigation.tool import run_tool

EXIT_STATUS = """exit status: 0 reached; 1 got nowhere; 2 wrong arguments; 3 no move_base, or it died; 4 cancelled by
somebody, another goal or an emergency stop; 6 refused: the map has no room there, or an emergency stop is pressed;
7 as near as possible (with a default_tolerance); 8 the robot does not know where it is; 130 Ctrl-C (the goal is
cancelled first)"""


def _number(least, most, allowed):
    """A reader for argparse, of numbers with bounds."""
    def read(text):
        with contextlib.suppress(ValueError):
            if least <= float(text) <= most:
                return float(text)
        raise argparse.ArgumentTypeError(f"found {text.strip()!r}, allowed: {allowed}")
    return read


COORDINATE = _number(-1000.0, 1000.0, "a number from -1000 to 1000 [m]")
YAW = _number(-6.284, 6.284, "a number from -6.28 to 6.28 [rad], not degrees")


def parse_arguments(words):
    """Options of the command line; exits with status 2 and a message when it is wrong."""
    parser = argparse.ArgumentParser(prog="goto", description="Send the robot to a place on the map by move_base.",
                                     epilog=EXIT_STATUS, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("x", type=COORDINATE, help="[m]")
    parser.add_argument("y", type=COORDINATE, help="[m]")
    parser.add_argument("yaw", type=YAW, help="where to look in the end [rad]")
    parser.add_argument("--patience", type=_number(0.0, 1e6, "a number from 0 to 1000000 [s]"), default=PATIENCE,
                        help="wait so long for move_base, or where a way is barred or a sensor gone [s] [%(default)s]")
    # a space before negative numbers: argparse takes -1e-3 for an option
    return parser.parse_args([re.sub(r"^(?=-[\d.in])", " ", word) for word in words])


def _run(options):
    """Outcome of the goal that the options describe."""
    goto, name = GoTo(functools.partial(print, flush=True)), rospy.resolve_name("move_base")
    if not goto.wait_for_server(0.5):
        print(f"waiting for {name}", flush=True)
        if not goto.wait_for_server(options.patience):
            return Outcome(Status.NOT_THERE, f"no {name} after {options.patience:g} s: is navigation.launch running?")
    goal = Goal(options.x, options.y, options.yaw)
    print(f"going to {goal}", flush=True)
    return goto.go(goal, options.patience)


def main():
    """Run goto, and exit with its status."""
    for end in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(end, signal.default_int_handler)
    run_tool("goto", functools.partial(_run, parse_arguments(rospy.myargv()[1:])))
