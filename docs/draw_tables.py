#!/usr/bin/env python3
"""Writes reference.md from the tables of the nodes, the launch files and setup/systems.txt.

draw_tables.py           writes it into this folder
draw_tables.py --check   ends with 1 when it is not as the code has it
"""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import yaml

from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.ros.server_parameters import COMMON_PARAMETERS
from robotont_fleet import fleet_node
from robotont_map_navigation import navigation_monitor
from robotont_operations import recorder_node
from robotont_simulator import camera_node, simulator_node
from robotont_teleop.hand import joy_watch, keyboard_teleop
from robotont_teleop.mux import cmd_vel_mux
from robotont_teleop.web import web_teleop_node

FOLDER = Path(__file__).resolve().parent
PAGE = FOLDER / "reference.md"
WHO = yaml.safe_load((FOLDER / "who_sets_it.yaml").read_text())
TOPICS = yaml.safe_load((FOLDER / "topics.yaml").read_text())
NODES = (driver_node, serial_com_node, odom_node, cmd_vel_mux, navigation_monitor, keyboard_teleop, joy_watch,
         web_teleop_node, recorder_node, simulator_node, camera_node, fleet_node)
HEAD = """<!-- Written by docs/draw_tables.py: `./robotont docs`. -->

# Reference: nodes, parameters, launch files, systems

A namespace is put before names of topics that begin with no `/`.

A node reads its parameters as it starts. After `rosparam set`, end it by `rosnode kill NODE`. Nodes of `robot.launch`
start again; `web_teleop_node` and `simulator_node` end their whole launch. `camera_node` ends for good.
`keyboard_teleop` takes only `_NAME:=VALUE`. A launch sets its arguments and the values of files in `config/` as it
starts: change these. A wrong value ends the node, with a message that says what is allowed.
With `composed:=true` the driver's three nodes are one, `robotont_node`. It has their topics, reads their parameters
under their names, and takes no `serial_write` or `serial_read` of other processes.
"""
SYSTEMS = """
## Systems

`./robotont` sets up these systems, on x86_64. On aarch64 (Raspberry Pi, Jetson) nothing was run.

| system | Python | ROS 1 | lacks | what ran |
| --- | --- | --- | --- | --- |
"""
ROS = """
Ubuntu 20.04 gets Noetic from packages.ros.org. The key of before June 2025 has expired. Install `ros-apt-source` of
[ros-infrastructure](https://github.com/ros-infrastructure/ros-apt-source/releases), then `ros-noetic-ros-base`.
Ubuntu 22.04 and 24.04 get [ROS One](https://ros.packages.techfak.net), `ros-one-ros-base`.
"""


def held(place, name):
    """The name of a parameter or an argument that somebody sets. Raises SystemExit when nobody does."""
    if name not in WHO.get(place, {}):
        sys.exit(f"docs/who_sets_it.yaml does not say who sets {name} of {place}; what nobody sets is a constant")
    return name


def allowed(one):
    """What a parameter may be, in short: a text and a switch say it by their defaults."""
    if not one.is_numeric:
        return ""
    return f"{one.minimum:.10g} to {one.maximum:.10g}"  # the reason is in the message that refuses another value


def parameters(place, table):
    """Lines of a list of parameters."""
    for one in table:
        unit = f" [{one.unit}]" if one.unit else ""
        default = f"=`{one.default}`" if one.default != "" else ""
        bounds = f"; {allowed(one)}" if allowed(one) else ""
        yield f"- `~{held(place, one.name)}`{default} {one.meaning}{unit}{bounds}"


def topics(place):
    """Lines of a list of topics and services."""
    for name, kind, meaning in TOPICS[place]:
        shown = name if "`" in name else ", ".join(f"`{one}`" for one in name.split(", "))
        yield f"- {shown} ({kind}) {meaning}"


def nodes():
    """Lines about every node."""
    yield from ("## every node", "", *parameters("common", COMMON_PARAMETERS))
    for node in NODES:
        name = node.__name__.rpartition(".")[2]
        yield from ("", f"## {name}", "")
        if name in TOPICS:
            yield from (*topics(name), *(("", "Parameters:", "") if node.PARAMETERS else ()))
        yield from parameters(name, node.PARAMETERS)


def launch_files():
    """Lines about every launch file."""
    yield from ("", "## Launch files", "", "`roslaunch robotont_bringup FILE name:=value ...`. roslaunch ignores a "
                "misspelt name; `roslaunch --ros-args robotont_bringup FILE` lists a file's own. "
                "Most files have `namespace`, too: put before the names of topics, for two robots on one master.")
    for file in sorted((FOLDER.parent / "launch").glob("*.launch")):
        comment = re.search(r"<!--\s*(.*?)\s*-->", file.read_text(), re.DOTALL)[1]
        comment = re.sub(r"docs/(([\w-]+)\.md)", r"[\2](\1)", re.sub(r"\s+", " ", comment))
        yield from ("", f"### {file.name}", "", comment)
        arguments = [one for one in ElementTree.parse(str(file)).getroot().findall("arg")
                     if one.get("doc") and held(file.name, one.get("name")) != "namespace"]
        if arguments:
            yield ""
        for one in arguments:
            default = re.sub(r"\$\(find (\w+)\)", r"\1", one.get("default"))
            shown = "" if not default or "$(" in default else f":=`{default}`"
            yield f"- `{one.get('name')}`{shown} {one.get('doc')}"


def systems():
    """Lines of the table of systems."""
    for line in (FOLDER.parent / "setup" / "systems.txt").read_text().splitlines():
        if not line.startswith("#"):
            _, name, python, ros, lacks, ran = (one.strip() for one in line.split("|"))
            yield f"| {name} | {python} | {ros} | {lacks} | {ran} |"


def page():
    """Text of reference.md."""
    return HEAD + "\n" + "\n".join([*nodes(), *launch_files()]) + "\n" + SYSTEMS + "\n".join(systems()) + "\n" + ROS


def main():
    """Write the page, or compare it."""
    stale = not PAGE.exists() or PAGE.read_text() != page()
    if stale and "--check" in sys.argv:
        print("docs/reference.md is not as the code has it: ./robotont docs writes it anew", file=sys.stderr)
        return 1
    PAGE.write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main())
