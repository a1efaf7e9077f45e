"""Runs a program again when it crashes: the launch-prefix of RViz, whose end ends the others of its launch file.

RViz was once seen to die of a segmentation fault as it started (docs/description.md). A user would start it again;
whoever closes its window wants it closed.
"""

import argparse
import os
import signal
import subprocess
import sys

CRASHES = {-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE, -signal.SIGILL}
TIMES = 3  # a program that crashes each time does not go on for ever


def run(command):
    """Exit status of a command, run TIMES more when it crashes."""
    for left in range(TIMES, -1, -1):
        process = subprocess.Popen(command)
        # roslaunch tells the whole group, others may tell only this process; the default action would leave an orphan
        signal.signal(signal.SIGINT, lambda *_: None)
        signal.signal(signal.SIGTERM, lambda number, _, process=process: process.send_signal(number))
        status = process.wait()
        if status not in CRASHES or not left:
            break
        print(f"{command[0]} crashed ({signal.Signals(-status).name}): started again", file=sys.stderr, flush=True)
    return status if status >= 0 else 128 - status


def main():
    """Run the command of the command line."""
    parser = argparse.ArgumentParser(description="Run a program, and again when it crashes; used by launch files.")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="the program and its arguments")
    command = parser.parse_args().command
    if command[:1] and os.path.basename(command[0]) == "rviz" and not os.environ.get("DISPLAY"):
        sys.exit("rviz needs a display, and DISPLAY is not set: watch the robot from a computer that has one "
                 "(docs/network.md), or in a browser: roslaunch robotont_bringup teleop.launch "
                 "(in a clone: ./robotont shell -c 'roslaunch robotont_bringup teleop.launch')")
    sys.exit(run(command))
