"""Files that people write by hand, in YAML, read with a message for every error."""

import math
import re

import yaml

from robotont_driver.parameters.files import read_file
from robotont_driver.parameters.parameters import fault

MOST_BYTES = 10 ** 5
MOST_LETTERS = 100  # of an angle
_NUMBERS = re.compile(r"(?:pi|[0-9.eE()/+ -]|\*(?!\*))*")  # no power: it may take for ever


def read_mapping(path, allowed):
    """(mapping, text) of a YAML file that contains one, or nothing; allowed: description of what it should contain.

    Angles may be written as for rosparam: deg(45), rad(pi/4), !degrees 45, !radians pi/4. Raises ValueError, in one
    line; OSError where it cannot be read or is too large.
    """
    try:
        text = read_file(path, MOST_BYTES).decode("utf-8")
        content = yaml.load(text, _Loader)  # a SafeLoader
    except UnicodeDecodeError as error:
        line, byte = error.object.count(b"\n", 0, error.start) + 1, error.object[error.start]
        raise ValueError(f"{path}: found the byte 0x{byte:02x} in line {line}, allowed: text in UTF-8") from None
    except yaml.MarkedYAMLError as error:
        problem, mark = error.problem, error.problem_mark or error.context_mark
        if error.context == "while scanning a simple key":
            problem, mark = "a name without a colon and a blank behind it", error.context_mark
        raise ValueError(f"{path}: no YAML: {problem}" + (f", in line {mark.line + 1}" if mark else "")) from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no YAML: {' '.join(str(error).split())}") from None
    if not isinstance(content, (dict, type(None))):
        raise ValueError(fault(str(path), content, allowed))
    return content or {}, text


class _Loader(yaml.SafeLoader):
    """Plain values and angles; every error is a YAMLError; no key twice, and no alias, which may repeat without end."""

    def compose_node(self, parent, index):
        """As Composer's."""
        if self.check_event(yaml.AliasEvent):
            raise _error("an alias: write out what it stands for", self.peek_event())
        return super().compose_node(parent, index)

    def construct_object(self, node, deep=False):
        """As Constructor's; what its constructors cannot read is an error of YAML: `!!timestamp x`, 2026-13-45."""
        try:
            return super().construct_object(node, deep)
        except (ValueError, ArithmeticError, LookupError, AttributeError, TypeError, NameError, SyntaxError):
            raise _error(f"{str(node.value)[:40]!r} is no {re.split('[:!]', node.tag)[-1]}", node) from None

    def construct_mapping(self, node, deep=False):
        """As Constructor's, without a key that stands twice."""
        keys = [(key.tag, key.value) for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for number, (key, _) in enumerate(node.value):
            if isinstance(key, yaml.ScalarNode) and (key.tag, key.value) in keys[:number]:
                raise _error(f"{key.value} stands twice", key)
        return super().construct_mapping(node, deep)

    def number(self, node):
        """As Constructor's, without what YAML reads in another base than people: 012 is ten, 1:30 is ninety."""
        whole = node.tag.endswith(":int")
        value = self.construct_yaml_int(node) if whole else self.construct_yaml_float(node)
        if ":" in node.value or (whole and re.match("[-+]?0[0-9_]", node.value)):
            meant = node.value.rpartition(":")[2].lstrip("0_") or 0
            raise _error(f"found {node.value}, which is {value} to YAML, allowed: a number, such as {meant}", node)
        return value

    def degrees(self, node):
        """[rad] of deg(45) and !degrees 45."""
        return math.radians(float(re.sub(r"^deg\((.*)\)$", r"\1", self.construct_scalar(node))))

    def radians(self, node):
        """[rad] of rad(pi/4) and !radians pi/4."""
        words = re.sub(r"^rad\((.*)\)$", r"\1", self.construct_scalar(node).strip())[:MOST_LETTERS].strip()
        if not _NUMBERS.fullmatch(words):
            raise ValueError(words)
        return float(eval(words, {"pi": math.pi}))


for _kind in ("int", "float"):
    _Loader.add_constructor("tag:yaml.org,2002:" + _kind, _Loader.number)
_Loader.add_constructor("!degrees", _Loader.degrees)
_Loader.add_constructor("!radians", _Loader.radians)
_Loader.add_implicit_resolver("!degrees", re.compile(r"^deg\([^)]*\)$"), "d")
_Loader.add_implicit_resolver("!radians", re.compile(r"^rad\([^)]*\)$"), "r")


def _error(words, part):
    """The error of YAML about a node or event."""
    return yaml.constructor.ConstructorError(None, None, words, part.start_mark)
