"""Checks for a launch file, before anything is started: the packages it starts are there, its nodes do not run yet.

A launch file calls it in its first tag, `<param name="..." command="$(find robotont_bringup)/require ..."/>`. What is
wrong is one line on stderr, and the exit status 1; roslaunch then ends with an error of its own, which names the
command, and has touched nothing. Without it roslaunch omits a node whose package is missing and goes on, or prints all
folders of ROS_PACKAGE_PATH; and two launches of the same nodes, each of which starts its own again, end each other's
for ever.
"""

import argparse
import http.client
import os
import re
import socket
import sys
import time
import xml.parsers.expat
import xmlrpc.client
from urllib.parse import urlsplit

import rospkg

CALLER = "/robotont_require"
REACHED = 1.0   # [s] for the connection to a node
PATIENCE = 5.0  # [s] for each answer: where a busy computer's comes later, a second launch is let in beside the first
SETTLE = 0.3    # [s] within which two launches that ask at once have both claimed
FRESH = 30.0    # [s] for which a claim counts; until then a launch has its nodes on the master
RPC_ERRORS = (OSError, ValueError, xmlrpc.client.Error, http.client.HTTPException, xml.parsers.expat.ExpatError)


def missing(packages):
    """Those of the packages that are in no folder of ROS_PACKAGE_PATH, in their order."""
    installed = set(rospkg.RosPack().list())
    return [package for package in packages if package not in installed]


def words(launch_file, packages, debian_package=None):
    """One line with the packages that a launch file lacks, and how to get them."""
    several = len(packages) > 1
    them = "them" if several else "it"
    remedy = f"on Ubuntu 20.04 sudo apt-get install {debian_package}; elsewhere, where apt has no " \
        f"{debian_package.replace('noetic', 'one')}, build {them} from source, and source that workspace " \
        "(for ./robotont: ROBOTONT_UNDERLAY=its devel folder)" if debian_package \
        else f"build {them} in this workspace"
    return (f"{launch_file} needs the ROS package{'s' if several else ''} {', '.join(packages)}, "
            f"which {'are' if several else 'is'} missing: {remedy}")


def running(names, master_uri):
    """(name, words on its process) of the first of these nodes that the master knows and that is there, or None.

    Also of one that hangs: when it goes on, its roslaunch would start it again, beside the new one.
    """
    socket.setdefaulttimeout(PATIENCE)
    for name in names:
        try:
            code, _, uri = xmlrpc.client.ServerProxy(master_uri).lookupNode(CALLER, name)
        except RPC_ERRORS:
            return None  # no master, or none that answers
        if code == 1 and _listens(uri):
            try:
                return name, f"process {xmlrpc.client.ServerProxy(uri).getPid(CALLER)[2]} on {urlsplit(uri).hostname}"
            except RPC_ERRORS:
                return name, f"it does not answer at {uri}"
    return None


def claimed(name, master_uri):
    """Claim a node's name for the launch that asks; (name, words on its process) when another one has, or None."""
    key, mine = "/robotont_launch" + name, [socket.gethostname(), os.getppid(), time.monotonic()]
    try:
        master = xmlrpc.client.ServerProxy(master_uri)
        code, _, other = master.getParam(CALLER, key)
        if code != 1 or not _starts(*other):
            master.setParam(CALLER, key, mine)
            time.sleep(SETTLE)
            other = master.getParam(CALLER, key)[2]
    except RPC_ERRORS:
        return None
    return (name, f"process {other[1]} on {other[0]} is starting it") if other[:2] != mine[:2] else None


def _starts(host, pid, since):
    """Whether the launch that has claimed a name may still be about to start its nodes; of other computers unknown."""
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return bool(file.read()) and host == socket.gethostname() and time.monotonic() - since < FRESH
    except OSError:
        return False


def _listens(uri):
    """Whether a process has the port of a node's URI; not when it was killed, or its computer is out of reach."""
    try:
        socket.create_connection((urlsplit(uri).hostname, urlsplit(uri).port), REACHED).close()
    except (OSError, ValueError):
        return False
    return True


def main():
    """Print "true" when all is as it should be; else the line on stderr, and exit with 1."""
    parser = argparse.ArgumentParser(description="Check what a launch file needs; used by launch files.")
    parser.add_argument("launch_file", help="who asks")
    parser.add_argument("--debian", metavar="PACKAGE", help="what installs them; without: packages of this repository")
    parser.add_argument("packages", nargs="*", help="ROS packages")
    parser.add_argument("--free", nargs="+", default=(), metavar="NODE", help="names that no running node may have")
    options = parser.parse_intermixed_args()
    lacking = missing(options.packages) if options.packages else ()
    if lacking:
        sys.exit(words(options.launch_file, lacking, options.debian))
    master_uri = os.environ.get("ROS_MASTER_URI", "")
    around = os.environ.get("ROS_NAMESPACE", "")  # roslaunch puts in there what has no slash in front
    paths = [name if name.startswith("/") else f"{around}/{name}" for name in options.free]
    names = ["/" + "/".join(filter(None, path.split("/"))) for path in paths]
    wrong = [name for name in names if not re.fullmatch(r"(/[A-Za-z]\w*)+", name, re.ASCII)]
    if wrong:
        sys.exit(f"{options.launch_file}: namespace: found {wrong[0].rpartition('/')[0]!r}, allowed: letters, digits "
                 "and _, of which a letter is the first; ROS takes no other names")
    other = names and (running(names, master_uri) or claimed(names[0], master_uri))
    if other:
        name, process = other
        sys.exit(f"{options.launch_file}: {name} runs already on ROS master {master_uri}: {process}. Use that one, or "
                 "end it first: by Ctrl-C where it was started, or services by sudo systemctl stop 'robotont*'. "
                 "roslaunch starts again what is killed. A second robot needs a namespace: namespace:=NAME or "
                 "__ns:=NAME, whichever the file has. A file that has neither: ROS_NAMESPACE=NAME before roslaunch")
    print("true")
