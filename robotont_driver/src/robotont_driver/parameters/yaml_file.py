"""Files of YAML that people write by hand: read with a message for every error in them."""

import ast
import math
import operator
import re
from pathlib import Path

import yaml

from robotont_driver.parameters.parameters import fault

MOST_BYTES = 10 ** 6
DEEPEST = 50
MOST_LETTERS = 100     # of an angle
MOST_VALUES = 10 ** 5  # in one file, each as often as an alias repeats it
_OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
              ast.USub: operator.neg, ast.UAdd: operator.pos}


def read_mapping(path, allowed):
    """(mapping, text) of a YAML file that contains one, or nothing; allowed: description of what it should contain.

    Angles may be written as for rosparam: deg(45), rad(pi/4), !degrees 45, !radians pi/4. Raises ValueError, in one
    line, with the error: no UTF-8, no YAML, too large, a key twice, no mapping. Raises OSError where it cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MOST_BYTES + 1)
        text = data.decode("utf-8")
        if len(data) > MOST_BYTES:
            raise ValueError(f"it has more than {MOST_BYTES} bytes")
        content = yaml.load(text, _Loader)  # a SafeLoader
    except UnicodeDecodeError as error:
        line, byte = error.object.count(b"\n", 0, error.start) + 1, error.object[error.start]
        raise ValueError(f"{path}: found the byte 0x{byte:02x} in line {line}, allowed: text in UTF-8") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise ValueError(f"{path}: no YAML: {error.problem}" + (f", in line {mark.line + 1}" if mark else "")) from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no YAML: {' '.join(str(error).split())}") from None
    if content is None:
        content = {}
    if not isinstance(content, dict):
        raise ValueError(fault(str(path), content, allowed))
    return content, text


class _Loader(yaml.SafeLoader):
    """Plain values and angles; every error is a YAMLError; no key twice, and aliases repeat only so much."""

    def __init__(self, stream):
        super().__init__(stream)
        self._sizes = {}  # values within a node
        self._depth = 0

    def compose_node(self, parent, index):
        """As Composer's, counting values."""
        alias = self.check_event(yaml.AliasEvent)
        self._depth += 1
        if self._depth > DEEPEST:
            raise _error(f"more than {DEEPEST} levels", self.peek_event())
        node = super().compose_node(parent, index)
        self._depth -= 1
        if alias and node not in self._sizes:
            raise _error("an alias of what it is part of", node)
        if not alias:
            parts = node.value if isinstance(node, yaml.CollectionNode) else ()
            if isinstance(node, yaml.MappingNode):
                parts = [part for pair in parts for part in pair]
            self._sizes[node] = 1 + sum(map(self._sizes.get, parts))
        if self._sizes[node] > MOST_VALUES:
            raise _error(f"more than {MOST_VALUES} values", node)
        return node

    def construct_object(self, node, deep=False):
        """As Constructor's; what its constructors cannot read is an error of YAML: `!!timestamp x`, 2026-13-45."""
        try:
            return super().construct_object(node, deep)
        except (ValueError, ArithmeticError, LookupError, AttributeError, TypeError, SyntaxError):
            raise _error(f"{str(node.value)[:40]!r} is no {re.split('[:!]', node.tag)[-1]}", node) from None

    def construct_mapping(self, node, deep=False):
        """As Constructor's, without a key that stands twice."""
        keys = [(key.tag, key.value) for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for number, (key, _) in enumerate(node.value):
            if isinstance(key, yaml.ScalarNode) and (key.tag, key.value) in keys[:number]:
                raise _error(f"{key.value} stands twice", key)
        return super().construct_mapping(node, deep)

    def degrees(self, node):
        """[rad] of deg(45) and !degrees 45."""
        return math.radians(float(re.sub(r"^deg\((.*)\)$", r"\1", self.construct_scalar(node))))

    def radians(self, node):
        """[rad] of rad(pi/4) and !radians pi/4."""
        words = re.sub(r"^rad\((.*)\)$", r"\1", self.construct_scalar(node).strip()).strip()
        return _number(ast.parse(words[:MOST_LETTERS], mode="eval").body)


_Loader.add_constructor("!degrees", _Loader.degrees)
_Loader.add_constructor("!radians", _Loader.radians)
_Loader.add_implicit_resolver("!degrees", re.compile(r"^deg\([^)]*\)$"), "d")
_Loader.add_implicit_resolver("!radians", re.compile(r"^rad\([^)]*\)$"), "r")


def _error(words, part):
    """The error of YAML about a node or event."""
    return yaml.constructor.ConstructorError(None, None, words, part.start_mark)


def _number(node):
    """Value of an expression of numbers, pi, + - * /. Raises ValueError."""
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.UnaryOp):
        return _OPERATORS[type(node.op)](_number(node.operand))
    if isinstance(node, ast.BinOp):
        return _OPERATORS[type(node.op)](_number(node.left), _number(node.right))
    return float(ast.literal_eval(node))
