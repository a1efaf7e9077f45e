"""./robotont status: running nodes, state of the board, active input and faults, in one short table."""

import argparse
import collections
import contextlib
import os
import sys
import textwrap
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray

from robotont_driver.rospy_repairs.rospy_process import init_tool
from robotont_operations import probes
from robotont_operations.health import OK, WARN, WORDS, table, worst

CALLER = "/robotont_status"
NO_MASTER = 3
COLUMNS = 100  # of a line
DIAGNOSTICS = 2.2  # [s] in which every node publishes its diagnostics at least twice
LONGEST = 10.0     # [s] for all of it; a master that hangs meanwhile holds up each question for ever


def nodes_alive(master):
    """{node: whether it answers} of all nodes that the master lists. Raises rosgraph.MasterException, RPC_ERRORS."""
    names = sorted({name for kind in master.getSystemState() for _, names in kind for name in names})
    names = [name for name in names if not name.startswith((CALLER, "/rosout"))]
    uris = probes.all_in_time(lambda name: rosgraph.Master(CALLER).lookupNode(name), names, 3.0)
    found = {name: uri for name, uri in zip(names, uris) if uri}  # the others have just ended
    answers = probes.all_in_time(lambda uri: probes.ask(uri, 1.0, "getPid", CALLER)[0] == 1, found.values(), 1.5)
    return dict(zip(found, map(bool, answers)))


def restarts(master):
    """{node: how often its roslaunch has started it again} of those that it had to."""
    found, = probes.all_in_time(master.getParam, ["/roslaunch/uris"], 1.5)
    uris = found.values() if isinstance(found, dict) else ()
    # those that run and those that have ended; of a roslaunch that is gone, or of another program at its port: None
    processes = probes.all_in_time(lambda uri: probes.ask(uri, 1.0, "list_processes")[2], uris, 1.5)
    counts = collections.Counter()
    for name, started in (pair for kinds in processes for pairs in kinds or () for pair in pairs):
        counts["/" + name.rpartition("-")[0]] += started - 1
    return +counts  # those above 0


def look():
    """Rows of the table. Raises as `nodes_alive`."""
    init_tool(CALLER[1:])
    master = rosgraph.Master(CALLER)
    alive = nodes_alive(master)
    return table(alive, newest_diagnostics(DIAGNOSTICS), sorted(restarts(master).items()), robots_of(alive))


def newest_diagnostics(duration):
    """{name: (level, words)} of the messages on /diagnostics within `duration` [s]."""
    statuses = {}
    rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: statuses.update(
        (status.name.lstrip("/"), (status.level, status.message)) for status in message.status))
    time.sleep(duration)
    return statuses


def robots_of(alive):
    """{namespace, with slashes: folder of the robot that a launch file has started there, and the version}."""
    found, ask = {}, rosgraph.Master(CALLER).getParam
    for space in {node.rpartition("/")[0] + "/" for node in alive}:
        with contextlib.suppress(*probes.RPC_ERRORS, rosgraph.MasterException):
            found[space] = f"{ask(space + 'robot')}; its driver_node names no version: it has not started, or is older"
            found[space] = f"{ask(space + 'robot')}, version {ask(space + 'version') or 'unknown'}"
    return found


def show(rows):
    """Print the table."""
    width = max(len(row.subject) for row in rows)
    for row in rows:
        head = f"{WORDS[row.level]:7}  {row.subject:{width}}  "
        lines = textwrap.wrap(row.words, max(30, COLUMNS - len(head)), break_long_words=False) or [""]
        print(head + f"\n{' ' * len(head)}".join(lines), flush=True)


def main():
    """Run status; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="./robotont status",
        description="Show what runs, the line to the board, the board, who drives, and what is wrong.",
        epilog="exit status: 0 all well; 1 a warning; 2 an error, a node that is missing or silent; 3 no ROS master")
    parser.parse_args(rospy.myargv()[1:])
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    if probes.master_place(uri) is None:
        print(f"status: found ROS_MASTER_URI={uri}, allowed: http://HOST:PORT", file=sys.stderr)
        return NO_MASTER
    try:
        probes.ask(uri, 2.5, "getPid", CALLER)
        rows = probes.start(look).result(LONGEST)
    except (rosgraph.MasterException, *probes.RPC_ERRORS):
        print(f"status: no ROS master answers at {uri}: no robot runs here. ./robotont sim starts a simulated one; why "
              "one in the network is not heard: ./robotont network", file=sys.stderr, flush=True)
        os._exit(NO_MASTER)  # rospy would ask it once more
    status = worst(rows)
    try:
        show(rows)
        if status not in {OK, WARN}:
            print("\n./robotont report packs an archive for fault diagnosis by others", flush=True)
    except BrokenPipeError:  # | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return status
