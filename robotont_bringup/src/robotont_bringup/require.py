"""Ends a launch file with one clear line where ROS packages are missing.

A launch file calls it in the first of its tags, `<param command="...">`, before anything is started. roslaunch itself
cannot end with words of one's own: a missing package behind $(find ...) prints all folders of ROS_PACKAGE_PATH, an
exception comes with the XML around it, a node with pkg="..." is only left out, and a required node ends roslaunch
with status 0. So this program prints the line and ends the roslaunch that asked, which has started nothing yet.
Whoever reads launch files in another way (rostest, roslaunch's Python API) gets its exception.
"""

import argparse
import os
import signal
import sys
from pathlib import Path

import rospkg


def missing(packages, paths=None):
    """Those of the packages that are in no folder of `paths` (default: ROS_PACKAGE_PATH), in their order."""
    known = set(rospkg.RosPack(paths).list())
    return [package for package in packages if package not in known]


def words(launch_file, packages, debian_package):
    """One line that says which packages a launch file lacks, and how to get them."""
    several = len(packages) > 1
    return (f"{launch_file} needs the ROS package{'s' if several else ''} {', '.join(packages)}, "
            f"which {'are' if several else 'is'} missing: sudo apt-get install {debian_package} "
            "(ROS Noetic; Debian itself has none)")


def is_roslaunch(command_line):
    """Whether a process' command line (a list of words) is that of the command roslaunch."""
    return any(Path(word).name == "roslaunch" for word in command_line[:2])


def command_line_of(process):
    """Words of a process' command line; none when it has ended."""
    try:
        return [os.fsdecode(word) for word in Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")]
    except OSError:
        return []


def main():
    """Print "true" when all packages are there; else the line, end a calling roslaunch, and exit with 1."""
    parser = argparse.ArgumentParser(description="Check that ROS packages are there; used by launch files.")
    parser.add_argument("launch_file", help="who asks")
    parser.add_argument("debian_package", help="what installs them")
    parser.add_argument("packages", nargs="+", help="ROS packages")
    options = parser.parse_args()
    lacking = missing(options.packages)
    if not lacking:
        print("true")
        return
    print(words(options.launch_file, lacking, options.debian_package), file=sys.stderr, flush=True)
    if is_roslaunch(command_line_of(os.getppid())):
        os.kill(os.getppid(), signal.SIGTERM)
    sys.exit(1)
