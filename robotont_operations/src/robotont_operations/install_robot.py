"""./robotont install-robot: the services that start Robotont at boot, and names for its boards."""

import argparse
import importlib.util
import ipaddress
import os
import pwd
import re
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import rospkg

from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.robots.robot_folder import read_robot
from robotont_operations import installation

ROOT = Path("/")
AFTER_INSTALL = (("systemd-sysusers",), ("udevadm", "control", "--reload"),
                 ("udevadm", "trigger", "--subsystem-match=tty"), ("systemctl", "daemon-reload"))
FOR_XACRO = "./robotont setup sim (a catkin workspace's shell needs its PYTHONPATH, too: docs/fleet.md)"
AFTER_REMOVAL = (("udevadm", "control", "--reload"), ("systemctl", "daemon-reload"))


def run(commands):
    """Run commands one after the other; a failure is reported, the rest still runs. Returns whether all succeeded."""
    good = True
    for command in commands:
        print("  " + " ".join(command))
        try:
            subprocess.run(command, check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"install-robot: failed, run it later: {error}", file=sys.stderr)
            good = False
    return good


def address(text):
    """A text under which other machines may find one: an IPv4 address or a host name. Raises ArgumentTypeError."""
    try:
        found = ipaddress.IPv4Address(text)
        good = not (found.is_loopback or found.is_unspecified or found.is_multicast)
    except ValueError:
        label = "[A-Za-z0-9]([A-Za-z0-9-]*[A-Za-z0-9])?"
        good = re.fullmatch(rf"{label}(\.{label})*", text) and re.search("[A-Za-z]", text) and text != "localhost"
    if not good:
        raise argparse.ArgumentTypeError(f"found {text!r}, allowed: an IPv4 address as in 10.0.0.1 (ip address), or a "
                                         "host name, under which others find it in a network")
    return text


def parse(arguments=None):
    """Options of the command line."""
    parser = ArgumentParser(
        prog="./robotont install-robot",
        description="Install services that start Robotont at boot, under a user "
        "of their own; udev rules that name its boards /dev/robotont and /dev/robotont_SERIALNUMBER; black box.")
    parser.add_argument("--robot", default="", metavar="NAME or FOLDER",
                        help="of config/robots; default: the one that is installed, else thesis; an official board "
                        "has to be named")
    parser.add_argument("--remove", action="store_true", help="remove all of it again, the black boxes too")
    parser.add_argument("--network", type=address, metavar="ADDRESS",
                        help="let other machines use the robot under this address of its (docs/safety.md: "
                        "there is no password); without it, also when you install again, the robot keeps to itself")
    parser.add_argument("--page", nargs="?", const="0.0.0.0", metavar="ADDRESS",
                        type=lambda text: text if text == "0.0.0.0" else address(text),
                        help="start the page for driving in a browser, too, with a token: from every network of the "
                        "robot, or at this address of its; kept when you install again")
    parser.add_argument("--fleet", type=address, metavar="ADDRESS",
                        help="bring the robot onto the page of all robots, too: address of the computer of "
                        "./robotont fleet; kept when you install again")
    options = parser.parse_args(arguments)
    try:
        folder = options.robot and read_robot(options.robot).folder
    except (OSError, ValueError) as error:
        parser.error(str(error))
    if "/" in options.robot:
        options.robot = str(folder.resolve())  # the service has another working directory
    return options


def main(arguments=None):
    """Run install-robot; returns the exit status."""
    options = parse(arguments)
    os.umask(0o022)  # the services' user reads what root writes
    try:
        return _remove() if options.remove else _install(options)
    except PermissionError as error:
        again = " ".join(map(shlex.quote, sys.argv[1:]))
        print(f"install-robot: {error.filename} may not be written: sudo ./robotont install-robot {again}",
              file=sys.stderr)
    except OSError as error:
        print(f"install-robot: {error}", file=sys.stderr)
    return 1


def _udev_rules():
    return sorted((Path(rospkg.RosPack().get_path("robotont_bringup")) / "udev").glob("*.rules"))


def _install(options):
    used = [part for name in ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "PYTHONPATH")
            for part in os.environ.get(name, "").split(":") if os.path.isdir(part)]
    closed = installation.unreadable(used)
    if closed:
        print(f"install-robot: the services' user may not enter {closed}: sudo chmod o+x {closed} (and it reads "
              "the workspace: sudo chmod -R o+rX FOLDER), or move the workspace to /opt", file=sys.stderr)
        return 1
    model = importlib.util.find_spec("xacro") is not None
    templates = Path(rospkg.RosPack().get_path("robotont_operations")) / "install"
    files, links = installation.planned(templates, _udev_rules(), os.environ, options, model)
    print(f"written, under {ROOT}:", *installation.install(files, links, options.robot, ROOT), sep="\n  ")
    kept = ROOT / installation.KEPT
    without = "description:=false" in installation.read(kept)
    if model and without:
        print(f"install-robot: {kept} is kept, and says description:=false: without it the robot has its model")
    elif without:
        print(f"install-robot: no xacro: the robot starts without its model. For one: {FOR_XACRO}, take "
              f"description:=false out of {kept}, then this again")
    elif not model:
        print(f"install-robot: no xacro: the robot does not start. Either {FOR_XACRO}, then this again; or, without "
              f"its model: description:=false behind ROBOTONT_ARGUMENTS= in {kept}, "
              "then sudo systemctl restart robotont")
    units = installation.installed_units(ROOT)
    good = run((*AFTER_INSTALL, ("systemctl", "restart", *units)))
    print("next: ./robotont status; the log: journalctl -fu 'robotont*'")
    if installation.PAGE_UNIT in units:
        elsewhere = re.search("^ROBOTONT_PAGE_ARGUMENTS=.*(certificate|web_port):=", installation.read(kept), re.M)
        at = re.search(r"address:=(\S+)", installation.read(ROOT / installation.SYSTEMD / installation.PAGE_UNIT))
        where = f"http://{at.group(1)}:8100/" if at and at.group(1) != "0.0.0.0" else \
            f"http://{socket.gethostname()}:8100/ (or the first address that hostname -I prints)"
        where = f"the page, as {kept} has its certificate:= and web_port:=" if elsewhere else where
        print(f"phones: {where}, and once the token that is made at the first start: "
              "sudo cat /var/lib/robotont/robotont_teleop_token")
    if options.fleet:
        print("fleet: the password that ./robotont fleet --add prints there:\n  echo PASSWORD | sudo install -o "
              f"robotont -m 600 /dev/stdin /{installation.STATE}/robotont_fleet_password; "
              "sudo systemctl restart robotont-fleet")
    return 0 if good else 1


def _remove():
    units = installation.installed_units(ROOT)
    if not units:
        print("install-robot: nothing is installed", file=sys.stderr)
        return 1
    good = run([("systemctl", "stop", *reversed(units))])
    print(f"removed, under {ROOT}:", *installation.remove(ROOT, _udev_rules()), sep="\n  ")
    ours = ("robotont", f"/{installation.STATE}")  # a person who was called so before has another home
    users = [("userdel", ours[0]) for user in pwd.getpwall() if (user.pw_name, user.pw_dir) == ours]
    return 0 if run((*users, *AFTER_REMOVAL)) and good else 1
