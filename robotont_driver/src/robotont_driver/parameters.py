"""Parameters that explain themselves: one table gives the checks, the defaults and the README."""

import difflib
import math
from typing import Any, NamedTuple, Optional, Tuple


class ParameterError(ValueError):
    """Parameters that cannot be used. `faults` lists every one: name, what was found, what is allowed."""

    def __init__(self, faults):
        super().__init__("\n".join(faults))
        self.faults = list(faults)


class Parameter(NamedTuple):
    """One parameter of a node: its type is the type of its default."""

    name: str
    default: Any
    meaning: str
    unit: str = ""
    minimum: Optional[float] = None
    choices: Tuple[str, ...] = ()

    @property
    def allowed(self):
        """What a valid value is, in words."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if isinstance(self.default, bool):
            return "true or false"
        if isinstance(self.default, str):
            return "a text"
        kind = "a whole number" if isinstance(self.default, int) else "a finite number"
        bound = "" if self.minimum is None else f" >= {self.minimum:g}"
        return kind + bound + (f" [{self.unit}]" if self.unit else "")

    def accepts(self, value):
        """Whether `value` has the type and lies within the bounds."""
        if self.choices:
            return value in self.choices
        if isinstance(self.default, (bool, str)):
            return isinstance(value, type(self.default))
        if isinstance(self.default, int) and not isinstance(value, int):
            return False
        return is_number(value) and (self.minimum is None or value >= self.minimum)


def is_number(value):
    """Whether `value` is a finite int or float (a bool is not a number)."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def fault(name, found, allowed):
    """Words for one wrong parameter."""
    return f"{name}: found {found!r}, allowed: {allowed}"


def read_parameters(table, given):
    """Values by name: what is `given` (a mapping), else the default.

    Raises ParameterError with every wrong value and every name that the table does not know.
    """
    known = {parameter.name: parameter for parameter in table}
    faults = [
        fault("~" + name, given[name], parameter.allowed)
        for name, parameter in known.items()
        if name in given and not parameter.accepts(given[name])
    ]
    faults += [_unknown(name, known) for name in given if name not in known]
    if faults:
        raise ParameterError(faults)
    return {name: type(p.default)(given.get(name, p.default)) for name, p in known.items()}


def markdown_rows(table):
    """Rows `| parameter | type | default | meaning |` of the README, which a test compares with it."""
    for parameter in table:
        kind = type(parameter.default).__name__
        unit = f" [{parameter.unit}]" if parameter.unit else ""
        yield f"| `~{parameter.name}` | {kind} | `{parameter.default}` | {parameter.meaning}{unit} |"


def _unknown(name, known):
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean ~{near[0]}?" if near else "this node knows " + ", ".join(sorted(known))
    return f"~{name}: no such parameter; {hint}"


DRIVER = (
    Parameter("publish_rate", 20.0, "how often the newest command is repeated", "Hz", minimum=1.0),
    Parameter("cmd_timeout", 0.5, "zeros after this long without a cmd_vel", "s", minimum=0.05),
    Parameter("command_decimals", 2, "decimals of each wheel speed; 0 for boards that read whole units",
              minimum=0),
    Parameter("max_linear_speed", 0.0, "limit of the speed over ground; 0 = off", "m/s", minimum=0.0),
    Parameter("max_angular_speed", 0.0, "limit of the turning speed; 0 = off", "rad/s", minimum=0.0),
    Parameter("max_wheel_speed", 0.0, "limit of the fastest wheel; 0 = off", "m/s", minimum=0.0),
    Parameter("max_linear_acceleration", 0.0, "limit of the change of speed; 0 = off", "m/s^2", minimum=0.0),
    Parameter("max_angular_acceleration", 0.0, "limit of the change of turning speed; 0 = off", "rad/s^2",
              minimum=0.0),
)

SERIAL_COM = (
    Parameter("port", "/dev/ttyACM0", "serial port of the board"),
    Parameter("baudrate", 115200, "speed of the line", "baud", minimum=1),
    Parameter("packets", "auto", "packets on the line: plain (the thesis'), checked (with CRC), or auto: "
              "checked from the first valid checked packet on", choices=("auto", "plain", "checked")),
    Parameter("write_timeout", 0.5, "one stop packet after this long without a serial_write", "s",
              minimum=0.05),
    Parameter("retry_period", 0.5, "pause between attempts to open the port", "s", minimum=0.05),
    Parameter("max_counts_per_period", 300, "what a motor can reach in one PID period; more is taken for "
              "an error on the line", "edges", minimum=1),
)

ODOM = (
    Parameter("odom_frame", "odom", "frame of the pose"),
    Parameter("base_frame", "base_link", "frame of the twist, and the child frame of the transform"),
    Parameter("publish_tf", True, "whether to publish odom_frame -> base_frame; false beside an EKF"),
    Parameter("packet_period", -1.0, "time that one packet stands for; negative = 1/pidControlFrequency; "
              "0 = packets hold speeds, measure the time between them", "s"),
    Parameter("solver", "least_squares", "step of the robot from n wheels: least_squares, or triples, the mean over "
              "every combination of three wheels", choices=("least_squares", "triples")),
    Parameter("wheel_noise", 0.005, "standard deviation of a wheel's path after 1 m, growing with the "
              "square root of the path", "m", minimum=0.0),
    Parameter("slip_false_alarms", 0.1, "false alarms per hour of driving that the search for slipping wheels may "
              "raise at most (4 or more wheels); 0 = no search", "1/h", minimum=0.0),
    Parameter("joint_prefix", "", "put before the names of the wheel joints"),
)

MOCK_SERIAL = ()
