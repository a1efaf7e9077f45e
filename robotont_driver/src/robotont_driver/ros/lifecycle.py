"""Start a node with checked parameters, or exit with all that is wrong; serve until ROS shuts down."""

import argparse
import contextlib
import difflib
import gc
import os
import signal
import sys
from typing import Callable, NamedTuple, Optional, Tuple

import rospy

from robotont_driver.parameters.parameters import (
    Parameter,
    ParameterError,
    help_text,
)
from robotont_driver.ros import rospy_end
from robotont_driver.ros.log_queue import queue_log
from robotont_driver.ros.node_parameters import (
    COMMON_PARAMETERS,
    own_parameters,
    parameter_of_another,
    private_parameters,
    refuse,
    running_wheels,
)


class Part(NamedTuple):
    """A node to start, alone in its process or beside others.

    name: its full name in the graph, under which its parameters stand. start(wheels, parameters) makes it; table:
    its parameters. check(wheels, parameters, other) returns a list of conflicts between parameters; other(name,
    default) is a parameter of another node.
    """

    name: str
    start: Callable
    table: Tuple[Parameter, ...]
    check: Optional[Callable] = None


def answer_help(name, explanation, table=()):
    """With the argument `-h`, print the explanation and the parameters of the table, and exit.

    Any other argument that is no remapping ends the program with 2, and a message.
    """
    parser = argparse.ArgumentParser(
        prog=name, description=explanation, epilog=help_text((*table, *COMMON_PARAMETERS)) if table else "",
        formatter_class=argparse.RawDescriptionHelpFormatter)
    _, unknown = parser.parse_known_args(rospy.myargv()[1:])
    if unknown:
        near = difflib.get_close_matches(unknown[0].strip("-").partition("=")[0], [one.name for one in table], 1)
        hint = f"did you mean _{near[0]}:=VALUE?" if near else f"see {name} -h"
        parser.error(f"no argument {unknown[0]}; {hint}")


def init_node(name, explanation, table=()):
    """Make this process the node `name`, after `answer_help`."""
    answer_help(name, explanation, table)
    rospy_end.init_node(name)
    queue_log()


def run_node(name, node_class, table):
    """Start a node, node_class(wheels, parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    serve(Part(rospy.get_name(), node_class, table))


def run_without_wheels(name, node_class, table):
    """Start a node that needs no wheels, node_class(parameters), in this process and serve until ROS shuts down."""
    init_node(name, sys.modules[node_class.__module__].__doc__, table)
    with signals_wait():
        node_class(own_parameters(table))
    _spin()


def serve(*parts):
    """Start the parts and serve until ROS shuts down; list wrong parameters, if any, of all parts and exit with 1."""
    with signals_wait():
        for start, wheels, parameters in _read_all(parts):
            start(wheels, parameters)
    _spin()


def _read_all(parts):
    """(start, wheels, parameters) of each part; ends the process with all faults, if any."""
    faults = []
    wheels = None
    try:
        wheels = running_wheels(rospy.get_namespace())
    except ParameterError as error:
        faults += error.faults
    starts = []
    for part in parts:
        whose = "" if part.name == rospy.get_name() else part.name + ": "
        try:
            parameters = private_parameters(part.table, part.name)
        except ParameterError as error:
            faults += [whose + message for message in error.faults]
            continue
        if part.check and wheels:
            faults += [whose + message for message in part.check(wheels, parameters, parameter_of_another)]
        starts.append((part.start, wheels, parameters))
    if faults:
        refuse(faults)
    return starts


@contextlib.contextmanager
def signals_wait():
    """SIGINT and SIGTERM that come within take effect behind it, or end the process where that takes too long.

    rospy shuts down within the signal's handler, which asks the master. Where the handler interrupts another question
    to the master, as starting nodes ask many, it waits for ever for the lock that the interrupted question holds.
    """
    came = []

    def note(number, _frame):
        came.append(number)
        rospy_end.end_soon()
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
