"""Checks for a launch file that the ROS packages it starts are there, before anything is started.

A launch file calls it in its first tag, `<param name="..." command="$(find robotont_bringup)/require ..."/>`. Where
packages are missing it prints one line that names them and how to get them, and exits with 1; roslaunch then ends with
an error of its own, which names the command. Without it roslaunch omits a node whose package is missing and goes
on, or prints all folders of ROS_PACKAGE_PATH.
"""

import argparse
import sys

import rospkg


def missing(packages, paths=None):
    """Those of the packages that are in no folder of `paths` (default: ROS_PACKAGE_PATH), in their order."""
    installed = set(rospkg.RosPack(paths).list())
    return [package for package in packages if package not in installed]


def words(launch_file, packages, debian_package=None):
    """One line with the packages that a launch file lacks, and how to get them."""
    several = len(packages) > 1
    remedy = f"sudo apt-get install {debian_package} (ROS Noetic; Debian itself has none)" if debian_package else \
        f"build {'them' if several else 'it'} in this workspace"
    return (f"{launch_file} needs the ROS package{'s' if several else ''} {', '.join(packages)}, "
            f"which {'are' if several else 'is'} missing: {remedy}")


def main():
    """Print "true" when all packages are there; else the line on stderr, and exit with 1."""
    parser = argparse.ArgumentParser(description="Check that ROS packages are there; used by launch files.")
    parser.add_argument("launch_file", help="who asks")
    parser.add_argument("--debian", metavar="PACKAGE", help="what installs them; without: packages of this repository")
    parser.add_argument("packages", nargs="+", help="ROS packages")
    options = parser.parse_args()
    lacking = missing(options.packages)
    if lacking:
        sys.exit(words(options.launch_file, lacking, options.debian))
    print("true")
