"""The command goto: sends the robot to a place, shows progress, and its exit status is the outcome."""

import argparse
import signal
import sys
import time

import rosgraph
import rospy

from robotont_driver.rospy_repairs.rospy_process import init_tool
from robotont_map_navigation.goal import (
    INTERRUPTED,
    NOT_THERE,
    Goal,
    Outcome,
    protect_negative,
    read_coordinate,
    read_seconds,
    read_yaw,
)
from robotont_map_navigation.goto_client import PATIENCE, GoTo

TERMINAL_PERIOD, LOG_PERIOD = 0.2, 2.0  # [s] between two lines of progress on a terminal and in a file
EXIT_STATUS = """exit status: 0 reached; 1 move_base gave up; 2 wrong arguments; 3 no move_base, or it died;
4 another goal took its place; 5 --timeout; 6 refused: no such place on the map, no way to it, or an emergency stop is
pressed; 7 as near as possible, but not there; 8 the robot does not know where it is; 130 Ctrl-C (the goal is cancelled
first)"""


class Display:
    """Lines of progress: one that changes on a terminal, one every LOG_PERIOD elsewhere."""

    def __init__(self):
        self._terminal = sys.stdout.isatty()
        self._shown = 0.0

    def show(self, line):
        """Print a line of progress when it is time."""
        now = time.monotonic()
        if now - self._shown >= (TERMINAL_PERIOD if self._terminal else LOG_PERIOD):
            self._shown = now
            print(f"\r\033[K{line}" if self._terminal else line, end="" if self._terminal else "\n", flush=True)

    def end(self, line, file):
        """Print the last line, below the progress."""
        if self._terminal and self._shown:
            print(flush=True)
        print(line, file=file, flush=True)


def _argument(read):
    """`read` for argparse, which shows the message of its own error only."""
    def parse(text):
        try:
            return read(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
    return parse


def parse_arguments(words):
    """Options of the command line; exits with status 2 and a message when it is wrong."""
    parser = argparse.ArgumentParser(prog="goto", description="Send the robot to a place on the map by move_base.",
                                     epilog=EXIT_STATUS, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("x", type=_argument(read_coordinate), help="[m]")
    parser.add_argument("y", type=_argument(read_coordinate), help="[m]")
    parser.add_argument("yaw", type=_argument(read_yaw), help="where to look in the end [rad]")
    parser.add_argument("--frame", default="map", help="frame of x, y and yaw [%(default)s]")
    parser.add_argument("--timeout", type=_argument(read_seconds), default=0.0,
                        help="cancel after this long, 0: never [s] [%(default)s]")
    parser.add_argument("--patience", type=_argument(read_seconds), default=PATIENCE,
                        help="wait so long where the way is barred or a sensor is gone, 0: never [s] [%(default)s]")
    parser.add_argument("--wait", type=_argument(read_seconds), default=30.0,
                        help="for move_base to come up [s] [%(default)s]")
    return parser.parse_args(protect_negative(words))


def run(options, display):
    """Outcome of the goal that the options describe."""
    if not rosgraph.is_master_online():
        return Outcome(NOT_THERE, f"no ROS master at {rosgraph.get_master_uri()}: is roslaunch running?")
    init_tool("goto")
    goal = Goal(options.x, options.y, options.yaw)
    goto = GoTo(options.frame, display.show)
    name = rospy.resolve_name("move_base")
    if not goto.wait_for_server(0.5):
        print(f"waiting for {name}", flush=True)
        if not goto.wait_for_server(options.wait):
            return Outcome(NOT_THERE, f"no {name} after {options.wait:g} s: is navigation.launch running?")
    print(f"going to {goal} in {options.frame}", flush=True)
    return goto.go(goal, options.timeout, options.patience)


def main():
    """Run goto; returns the exit status."""
    def interrupt(_signal, _frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGTERM, interrupt)
    options = parse_arguments(rospy.myargv()[1:])
    display = Display()
    try:
        end = run(options, display)
    except KeyboardInterrupt:  # before there was a goal
        end = Outcome(INTERRUPTED, "interrupted")
    display.end(end.words, sys.stdout if end.status == 0 else sys.stderr)
    return end.status
