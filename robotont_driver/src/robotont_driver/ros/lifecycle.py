"""Start a node with checked parameters, or exit with all that is wrong; serve until ROS shuts down."""

import argparse
import contextlib
import gc
import os
import signal
import sys

import rospy

from robotont_driver.parameters.parameters import ParameterError, help_text, nearest
from robotont_driver.ros.server_parameters import COMMON_PARAMETERS, private_parameters, running_wheels
from robotont_driver.rospy_repairs import rospy_process
from robotont_driver.rospy_repairs.rospy_process import queue_log


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
    """With the argument `-h`, print the explanation and the parameters of the table, and exit.

    Any other argument that is no remapping ends the program with 2, and a message.
    """
    parser = argparse.ArgumentParser(
        prog=name, description=explanation, epilog="" if table is None else help_text((*table, *COMMON_PARAMETERS)),
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
    queue_log()


def run_node(node_class, *arguments):
    """Start a node in this process, see `serve`, under the name of its module, and serve until ROS shuts down."""
    module = sys.modules[node_class.__module__]
    init_node(module.__name__.rpartition(".")[2], module.__doc__, module.PARAMETERS)
    serve({rospy.get_name(): node_class}, *arguments)


def run_without_wheels(name, node_class, table):
    """Start a node that needs no wheels, node_class(parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    with signals_wait():
        node_class(own_parameters(table))
    _spin()


def serve(parts, *arguments):
    """Start nodes, node_class(name, wheels, parameters, *arguments), and serve until ROS shuts down.

    parts: the class by the node's full name in the graph, under which its parameters stand; its module has their table,
    PARAMETERS. Exits with 1 and all wrong parameters of all parts, or with what a class raises as ParameterError.
    """
    faults, wheels, values = [], None, {}
    with signals_wait():
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


@contextlib.contextmanager
def signals_wait():
    """SIGINT and SIGTERM that come within take effect behind it, or end the process where that takes too long.

    rospy asks the master within the signal's handler. Where that interrupts another question to the master, as starting
    nodes ask many, it waits for ever for the lock that the interrupted question holds.
    """
    came = []

    def note(number, _frame):
        came.append(number)
        rospy_process.end_soon()
    handlers = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in came[:1]:
            os.kill(os.getpid(), number)


def _spin():
    gc.collect()
    gc.freeze()  # what exists now stays: the collector need not look through it while messages wait
    rospy.spin()
