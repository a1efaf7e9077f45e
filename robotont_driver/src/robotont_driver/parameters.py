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
    official: str = ""  # name in the official driver, relative to the namespace: read where ours is not given

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
