"""Start a node with checked parameters, or exit with all that is wrong; serve until ROS shuts down."""

import argparse
import gc
import sys
import textwrap

import rospy

from robotont_driver.parameters.parameters import ParameterError, nearest
from robotont_driver.ros.server_parameters import COMMON_PARAMETERS, private_parameters, running_wheels
from robotont_driver.rospy_repairs import rospy_process


def own_parameters(table):
    """The private parameters of a node that needs no wheels, by name; lists wrong ones, if any, and exits with 1."""
    try:
        return private_parameters(table)
    except ParameterError as error:
        return refuse(error.faults)


def refuse(faults):
    """End the node because of its parameters, with a line for each fault."""
    for message in faults:
        rospy.logfatal("wrong parameter %s", message)
    sys.exit(1)


def answer_help(name, explanation, table=None):
    """With the argument `-h`, print explanation and parameters and exit; with one that is no remapping exit with 2."""
    lines = [textwrap.fill(f"~{one.name} (default: {one.default!r} {one.unit}): {one.meaning}; allowed: {one.allowed}",
                           78, subsequent_indent="    ")
             for one in (() if table is None else (*table, *COMMON_PARAMETERS))]
    parser = argparse.ArgumentParser(prog=name, description=explanation, epilog="\n".join(lines),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    _, unknown = parser.parse_known_args(rospy.myargv()[1:])
    if unknown:
        meant = "_" + unknown[0].strip("-").partition("=")[0]
        hint = nearest(meant + ":=VALUE", [f"_{one.name}:=VALUE" for one in table or ()]) or f"; see {name} -h"
        parser.error(f"no argument {unknown[0]}{hint}")


def init_node(name, explanation, table=None):
    """Make this process the node `name`, after `answer_help`."""
    answer_help(name, explanation, table)
    rospy_process.init_node(name)


def run_node(node_class, *arguments):
    """Start a node in this process, see `serve`, under the name of its module, and serve until ROS shuts down."""
    module = sys.modules[node_class.__module__]
    init_node(module.__name__.rpartition(".")[2], module.__doc__, module.PARAMETERS)
    serve({rospy.get_name(): node_class}, *arguments)


def run_without_wheels(name, node_class, table):
    """Start a node that needs no wheels, node_class(parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    node_class(own_parameters(table))
    _spin()


def serve(parts, *arguments):
    """Start nodes, node_class(name, wheels, parameters, *arguments), and serve until ROS shuts down.

    parts: the class by the node's full name in the graph, under which its parameters stand; its module has their table,
    PARAMETERS. Exits with 1 and all wrong parameters of all parts, or with what a class raises as ParameterError.
    """
    faults, wheels, values = [], None, {}
    try:
        wheels = running_wheels(rospy.get_namespace())
    except ParameterError as error:
        faults += error.faults
    for name, node_class in parts.items():
        try:
            values[name] = private_parameters(sys.modules[node_class.__module__].PARAMETERS, name)
        except ParameterError as error:
            faults += [("" if name == rospy.get_name() else name + ": ") + words for words in error.faults]
    try:
        for name, node_class in () if faults else parts.items():
            node_class(name, wheels, values[name], *arguments)
    except ParameterError as error:
        faults = error.faults
    if faults:
        refuse(faults)
    _spin()


def _spin():
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while messages wait
    rospy.spin()
