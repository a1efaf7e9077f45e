"""./robotont status: running nodes, state of the board, active input and faults, in one short table."""

import argparse
import contextlib
import os
import sys
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray

from robotont_driver.rospy_end import init_tool
from robotont_operations import probes
from robotont_operations.colours import GREEN, RED, YELLOW, paint
from robotont_operations.health import OK, WARN, WORDS, table, worst

CALLER = "/robotont_status"
NO_MASTER = 3
DIAGNOSTICS = 2.2  # [s] in which every node publishes its diagnostics at least twice
COLOURS = (GREEN, YELLOW, RED, RED)


def nodes_alive(master):
    """{node: whether it answers} of all nodes that the master lists. Raises OSError, rosgraph.MasterException."""
    names = sorted({name for kind in master.getSystemState() for _, names in kind for name in names})
    names = [name for name in names if not name.startswith((CALLER, "/rosout"))]
    uris = [master.lookupNode(name) for name in names]

    def answers(uri):
        try:
            return probes.remote(uri, 1.0).getPid(CALLER)[0] == 1
        except probes.RPC_ERRORS:
            return False
    return dict(zip(names, map(bool, probes.all_in_time(answers, uris, 1.5))))


def newest_diagnostics(duration):
    """{name: (level, words, {key: value})} of the messages on /diagnostics within `duration` [s]."""
    statuses = {}

    def on_diagnostics(message):
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            statuses[status.name.lstrip("/")] = status.level, status.message, values
    rospy.Subscriber("/diagnostics", DiagnosticArray, on_diagnostics)
    time.sleep(duration)
    return statuses


def show(rows):
    """Print the table."""
    width = max(len(row.subject) for row in rows)
    for row in rows:
        print(f"{paint(f'{WORDS[row.level]:7}', COLOURS[row.level])}  {row.subject:{width}}  {row.words}")


def main():
    """Run status; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="status", description="Show what runs, the line to the board, the board, who drives, and what is wrong.",
        epilog="exit status: 0 all well; 1 a warning; 2 an error, a node that is missing or silent; 3 no ROS master")
    parser.parse_args(rospy.myargv()[1:])
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    answered = False
    with contextlib.suppress(*probes.RPC_ERRORS):
        answered, _ = probes.in_time(probes.remote(uri, 2.0).getPid, 2.5, CALLER)
    if not answered:
        print(f"status: no ROS master at {uri}: is the robot's stack running? see ./robotont network",
              file=sys.stderr)
        return NO_MASTER
    init_tool(CALLER[1:])
    try:
        alive = nodes_alive(rosgraph.Master(CALLER))
    except (OSError, rosgraph.MasterException) as error:
        print(f"status: the ROS master at {uri} has stopped answering: {error}", file=sys.stderr)
        return NO_MASTER
    rows = table(alive, newest_diagnostics(DIAGNOSTICS))
    show(rows)
    status = worst(rows)
    if status not in {OK, WARN}:
        print("\n./robotont report packs an archive for fault diagnosis by others")
    return status
