"""The parameters of nodes on the parameter server: read, checked, or the node exits."""

import sys

import rosgraph
import rospy

from robotont_driver.kinematics.wheel_params import KEYS, read_wheels
from robotont_driver.parameters.parameters import (
    Parameter,
    ParameterError,
    fault,
    is_number,
    read_parameters,
)

# Parameters that every node has besides its own.
COMMON_PARAMETERS = (
    Parameter("diagnostic_period", 1.0, "between two diagnostics", "s", minimum=0.1, maximum=60.0),
)


def running_wheels(namespace):
    """`Wheels` of the robot that runs in a namespace, from its parameters. Raises ParameterError.

    Not by rospy.get_param: in a process that has logged a line, "/" is there only what rospy's logging looked up.
    """
    try:
        given = rosgraph.Master(rospy.get_name()).getParam(namespace)
    except rosgraph.MasterError:  # no such namespace
        given = {}
    if not any(key in given for key in KEYS):
        raise ParameterError([f"wheelAmount and its kin: found none in {namespace}, where no robot runs: start "
                              "robot.launch or simulation.launch first, or rosparam load "
                              "config/robots/NAME/wheel_params.yaml"])
    try:
        return read_wheels(given)
    except ParameterError as error:
        raise ParameterError(f"{message} (wheel parameters are read from {namespace})"
                             for message in error.faults) from None


def private_parameters(table, node="~"):
    """The parameters of a node of this process by name. Raises ParameterError."""
    given = rospy.get_param(node, {})
    if not isinstance(given, dict):
        raise ParameterError([fault("~", given, "parameters by name, as in `publish_rate: 20.0`: is a line missing?")])
    given = {**official_parameters(table), **given}
    return read_parameters((*table, *COMMON_PARAMETERS), given)


def own_parameters(table):
    """The private parameters of a node that needs no wheels, by name; lists wrong ones, if any, and exits with 1."""
    try:
        return private_parameters(table)
    except ParameterError as error:
        return refuse(error.faults)


def parameter_of_another(name, default):
    """A number on the parameter server, by a name relative to the namespace, such as driver_node/publish_rate.

    The default where there is none, or none that is a number: the other node refuses that.
    """
    value = rospy.get_param(name, default)
    return value if is_number(value) else default


def refuse(faults):
    """End the node because of its parameters, with a line for each fault."""
    for message in faults:
        rospy.logfatal("wrong parameter %s", message)
    sys.exit(1)


def official_parameters(table):
    """Values by our names of parameters that are given under the official driver's names."""
    names = {parameter.name: parameter.official for parameter in table if parameter.official}
    return {name: rospy.get_param(official) for name, official in names.items() if rospy.has_param(official)}
