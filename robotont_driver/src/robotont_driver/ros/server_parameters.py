"""The parameter server: the wheels and a node's parameters off it, a node's value kept on it."""

import contextlib
import threading

import rosgraph
import rospy

from robotont_driver.kinematics.wheel_params import KEYS, read_wheels
from robotont_driver.parameters.parameters import Parameter, ParameterError, fault, read_parameters
from robotont_driver.ros.repeating_thread import RepeatingThread

AGAIN = 1.0  # [s] after which it is written again, to a master that did not answer, or to a new one
# Parameters that every node has besides its own.
COMMON_PARAMETERS = (
    Parameter("diagnostic_period", 1.0, "between two diagnostics, if any", "s", minimum=0.1, maximum=1.0),
)


def running_wheels(namespace):
    """`Wheels` of the robot that runs in a namespace, from its parameters. Raises ParameterError."""
    # not by rospy.get_param: once a process has logged a line, that has of "/" only what rospy's logging looked up
    try:
        given = rosgraph.Master(rospy.get_name()).getParam(namespace)
    except rosgraph.MasterError:  # no such namespace
        given = {}
    if not any(key in given for key in KEYS):
        raise ParameterError([f"wheelAmount and its kin: found none in {namespace}, where no robot runs: "
                              "start robot.launch, or rosparam load config/robots/NAME/wheel_params.yaml "
                              + namespace])
    try:
        return read_wheels(given)
    except ParameterError as error:
        raise ParameterError(f"{message} (wheel parameters are read from {namespace})"
                             for message in error.faults) from None


def private_parameters(table, node="~"):
    """The parameters of a node of this process by name, or by the official driver's. Raises ParameterError."""
    given = rospy.get_param(node, {})
    if not isinstance(given, dict):
        raise ParameterError([fault("~", given, "parameters by name, as in `publish_rate: 20.0`: is a line missing?")])
    official = {parameter.name: rospy.get_param(parameter.official) for parameter in table
                if parameter.official and rospy.has_param(parameter.official)}
    return read_parameters((*table, *COMMON_PARAMETERS), {**official, **given})


def kept_names(name):
    """The names that a `KeptParameter` holds."""
    names = rospy.get_param(name, ())
    return [str(one) for one in names] if isinstance(names, list) else []


class KeptParameter:
    """Writes the newest `value()` in a thread of its own after each change: the master may take its time."""

    # and every AGAIN [s], but for values that count as false: a new master has none

    def __init__(self, name, value):
        self._name, self._value, self._written = name, value, value()
        self._changed = threading.Event()
        RepeatingThread(self._write)

    def changed(self):
        """The value may be another one now. Returns at once."""
        self._changed.set()

    def _write(self):
        self._changed.wait(AGAIN)
        self._changed.clear()
        value = self._value()
        if value or value != self._written:
            with contextlib.suppress(OSError):  # no master: again in a while
                rospy.set_param(self._name, value)
                self._written = value
        return 0.0
