"""Parameters that explain themselves: one table gives the checks, the defaults and the pages of docs/."""

import contextlib
import difflib
import math
from typing import Any, NamedTuple, Optional, Tuple

LONGEST_SHOWN = 200  # characters of a found value in messages


class ParameterError(ValueError):
    """Parameters that cannot be used. `faults` lists every one: name, what was found, what is allowed."""

    def __init__(self, faults):
        self.faults = list(faults)
        super().__init__("\n".join(self.faults))


class Parameter(NamedTuple):
    """One parameter of a node, of its default's type; a number lies from `minimum` to `maximum`, for a `reason`."""

    name: str
    default: Any
    meaning: str
    unit: str = ""
    minimum: Optional[float] = None
    maximum: Optional[float] = None
    reason: str = ""
    choices: Tuple[str, ...] = ()
    official: str = ""  # name in the official driver, relative to the namespace: read where ours is not given

    @property
    def is_numeric(self):
        """Whether its values are numbers."""
        return isinstance(self.default, (int, float)) and not isinstance(self.default, bool)

    @property
    def allowed(self):
        """Description of the valid values."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if isinstance(self.default, bool):
            return "true or false"
        if isinstance(self.default, str):
            return "a string"
        kind = "a whole number" if isinstance(self.default, int) else "a finite number"
        unit, reason = f" [{self.unit}]" if self.unit else "", f": {self.reason}" if self.reason else ""
        return f"{kind} from {self.minimum:.10g} to {self.maximum:.10g}{unit}{reason}"

    def accepts(self, value):
        """Whether `value` has the type and lies within the bounds."""
        if self.choices:
            return value in self.choices
        if not self.is_numeric:
            return isinstance(value, type(self.default))
        valid = is_whole if isinstance(self.default, int) else is_number
        return valid(value) and self.minimum <= value <= self.maximum


def is_number(value):
    """Whether `value` is a finite int or float (a bool is not a number)."""
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an int beyond every float
        return False


def is_whole(value):
    """Whether `value` is a whole number: 64, or 64.0, which some tools write for it."""
    return is_number(value) and value == int(value)


def fault(name, found, allowed):
    """Message about one wrong parameter."""
    return f"{name}: found {shown(found)}, allowed: {allowed}" + (_as_number(found) if "number" in allowed else "")


def _as_number(found):
    """How a number is to be written that YAML takes for a text, as 1e-2; empty where there is none."""
    import yaml  # here: `./robotont sim` reads its arguments before anything is installed

    for part in found if isinstance(found, list) else [found]:
        with contextlib.suppress(ValueError):
            if isinstance(part, str) and math.isfinite(float(part)):
                number = int(float(part)) if float(part).is_integer() else float(part)
                return f"; {shown(part)} is a text to YAML, write {yaml.safe_dump(number).split()[0]}"
    return ""


def nearest(name, known):
    """Question about the one of the `known` names that another was meant to be; empty where none is like it."""
    near = difflib.get_close_matches(name[:100], known, 1)
    return f"; did you mean {near[0]}?" if near else ""


def shown(value):
    """A value as Python writes it, of bounded length."""
    return repr(value)[:LONGEST_SHOWN]


def read_parameters(table, given):
    """Values by name: the `given` ones (a mapping), else the defaults. Raises ParameterError with every fault."""
    known = {parameter.name: parameter for parameter in table}
    faults = [fault("~" + name, given[name], parameter.allowed) for name, parameter in known.items()
              if name in given and not parameter.accepts(given[name])]
    for name in given:
        if name not in known:
            hint = nearest(f"~{name}", ["~" + one for one in known]) or "; this node has " + ", ".join(sorted(known))
            faults.append(f"~{str(name)[:100]}: no such parameter{hint}")
    if faults:
        raise ParameterError(faults)
    return {name: type(p.default)(given.get(name, p.default)) for name, p in known.items()}
