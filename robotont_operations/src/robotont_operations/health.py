"""From nodes and diagnostics to the table that ./robotont status shows."""

import re
from typing import NamedTuple

OK, WARN, ERROR, STALE = 0, 1, 2, 3  # levels of diagnostic_msgs/DiagnosticStatus
WORDS = ("ok", "warning", "ERROR", "SILENT")
NODES = ("driver_node", "serial_com_node", "odom_node")  # without which no robot drives ...
COMPOSED = "robotont_node"                               # ... in processes of their own, or all in this one
# in the table's order
SUBJECTS = ("who drives", "guard", "command stream", "link", "board", "wheel feedback", "black box")


class Row(NamedTuple):
    """A line of the table."""

    level: int
    subject: str
    words: str


def table(alive, statuses, restarts=(), folders=()):
    """Rows of the table: of each robot, then the diagnostics of what is in no robot's namespace.

    alive: {node name: whether it answers} of all that the master lists; statuses: {name: (level, words)} of the newest
    diagnostics, whose names are "NODE: SUBJECT"; restarts: (node name, how often it was started again);
    folders: {namespace, with slashes: the robot's folder}.
    """
    rows = []
    robots = sorted({re.sub(r"[^/]+$", "", node) for node in alive
                     if node.rpartition("/")[2] in (*NODES, COMPOSED)}) or ["/"]
    for robot in robots:
        name = robot.strip("/")
        composed = robot + COMPOSED in alive
        missing = [] if composed else [node for node in NODES if robot + node not in alive]
        own = [node for node in alive if _is_of(node, robot, robots)]
        silent = sorted(node for node in own if not alive[node])
        faults = [f"{node} is not running" for node in missing] + [f"{node} does not answer" for node in silent]
        tasks = [(full.partition(": ")[2] or full, *status) for full, status in statuses.items()
                 if _is_of(f"/{full}", robot, robots)]
        label = f"{name}: " if name else ""
        again = [f"restarts of {node}: {count}" for node, count in restarts if _is_of(node, robot, robots)]
        again += ["why: where the robot was started, or journalctl -u 'robotont*'"] if again else []
        rows.append(Row(ERROR if faults else WARN if again else OK, label + "nodes",
                        "; ".join((faults or [f"{len(own)} running"]) + again)))
        if robot in folders:
            rows.append(Row(OK, label + "robot", folders[robot]))
        order = {subject: place for place, subject in enumerate(SUBJECTS)}
        for subject, level, words in sorted(tasks, key=lambda one: (order.get(one[0], len(order)), one[0])):
            rows.append(Row(level if level in range(len(WORDS)) else ERROR, label + subject, words))
        for node, subject in (("serial_com_node", "link"), ("driver_node", "command stream"),
                              ("odom_node", "wheel feedback")):
            if alive.get(robot + (COMPOSED if composed else node)) and not any(one[0] == subject for one in tasks):
                rows.append(Row(STALE, label + subject, f"{node} publishes nothing on /diagnostics"))
    others = [(full, *status) for full, status in sorted(statuses.items()) if not f"/{full}".startswith(tuple(robots))]
    return rows + [Row(level if level in range(len(WORDS)) else ERROR, full, words) for full, level, words in others]


def worst(rows):
    """Exit status: 0 all well, 1 a warning, 2 an error or silence."""
    return min(max(row.level for row in rows), ERROR)


def _is_of(name, robot, robots):
    """Whether a full name is in this robot's namespace and in none of another robot within it."""
    return name.startswith(robot) and not any(
        name.startswith(other) for other in robots if other != robot and other.startswith(robot))
