#!/usr/bin/env python3
"""Writes parameters.md and launch.md from the tables of the nodes and from the launch files.

draw_tables.py           writes them into this folder
draw_tables.py --check   ends with 1 and says which one is not as the code has it
"""

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import yaml

from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.ros.lifecycle import COMMON_PARAMETERS
from robotont_fleet import fleet_node
from robotont_map_navigation import navigation_monitor
from robotont_operations import recorder_node
from robotont_simulator import simulator_node
from robotont_teleop.hand import joy_watch, keyboard_teleop
from robotont_teleop.mux import cmd_vel_mux
from robotont_teleop.web import web_teleop_node

FOLDER = Path(__file__).resolve().parent
WHO = yaml.safe_load((FOLDER / "who_sets_it.yaml").read_text())
NODES = (driver_node, serial_com_node, odom_node, cmd_vel_mux, keyboard_teleop, joy_watch, web_teleop_node,
         recorder_node, navigation_monitor, simulator_node, fleet_node)
HEAD = "<!-- Written by draw_tables.py: `./robotont docs`. -->\n"


def cell(text):
    """Text that may stand in a cell of a table."""
    return str(text).replace("|", "\\|")


def who(place, name):
    """Who sets a parameter of a node, or an argument of a launch file. Raises SystemExit when nobody does."""
    if name not in WHO.get(place, {}):
        sys.exit(f"docs/who_sets_it.yaml does not say who sets {name} of {place}; what nobody sets is a constant")
    return cell(WHO[place][name])


def table(place, parameters):
    """Lines of a table of parameters."""
    yield "| parameter | default | meaning | allowed | who sets it |"
    yield "| --- | --- | --- | --- | --- |"
    for one in parameters:
        unit = f" [{one.unit}]" if one.unit else ""
        default = f"`{one.default}`" if one.default != "" else "empty"
        yield (f"| `~{one.name}` | {default} | {cell(one.meaning)}{unit} | {cell(one.allowed)} | "
               f"{who(place, one.name)} |")


def parameters_page():
    """Text of parameters.md."""
    lines = [HEAD, "# Parameters", "", "A node reads its parameters once, as it starts; after `rosparam set`, "
             "`rosnode kill NODE` applies it where roslaunch starts the node again (with `composed:=true` NODE is "
             "`/robotont_node` for driver_node, serial_com_node and odom_node). There is no dynamic_reconfigure. A "
             "wrong value ends the node with a message; `-h` shows the same table. "
             "What belongs to a robot stands in its folder: [robots](robots.md).", "", "Each node has one "
             "more:", "", *table("common", COMMON_PARAMETERS)]
    for node in NODES:
        name = node.__name__.rpartition(".")[2]
        lines += ["", f"## {name}", "", *table(name, node.PARAMETERS)]
    return "\n".join(lines) + "\n"


def launch_page():
    """Text of launch.md."""
    lines = [HEAD, "# Launch files", "", "`roslaunch robotont_bringup FILE name:=value ...`. A misspelt name of an "
             "argument is ignored by roslaunch; `roslaunch --ros-args robotont_bringup FILE` lists them."]
    for file in sorted((FOLDER.parent / "launch").glob("*.launch")):
        comment = re.search(r"<!--\s*(.*?)\s*-->", file.read_text(), re.DOTALL)[1]
        lines += ["", f"## {file.name}", "", re.sub(r"\s+", " ", comment)]
        arguments = [one for one in ElementTree.parse(str(file)).getroot().findall("arg") if one.get("doc")]
        if arguments:
            lines += ["", "| argument | default | meaning | who sets it |", "| --- | --- | --- | --- |"]
        for one in arguments:
            default = re.sub(r"\$\(find (\w+)\)", r"\1", one.get("default"))
            shown = "empty" if not default else "computed" if "$(" in default else f"`{default}`"
            lines.append(f"| `{one.get('name')}` | {shown} | {cell(one.get('doc'))} | "
                         f"{who(file.name, one.get('name'))} |")
    return "\n".join(lines) + "\n"


def main():
    """Write the pages, or compare them."""
    pages = {"parameters.md": parameters_page(), "launch.md": launch_page()}
    stale = [name for name, text in pages.items()
             if not (FOLDER / name).exists() or (FOLDER / name).read_text() != text]
    if "--check" in sys.argv:
        for name in stale:
            print(f"docs/{name} is not as the code has it: ./robotont docs writes it anew", file=sys.stderr)
        return 1 if stale else 0
    for name in stale:
        (FOLDER / name).write_text(pages[name])
    return 0


if __name__ == "__main__":
    sys.exit(main())
