"""Files that people write by hand (YAML), read with a message for every error; files written whole or not at all."""

import contextlib
import errno
import fcntl
import math
import os
import re
import tempfile
from pathlib import Path

import yaml

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
        mark = error.problem_mark or error.context_mark
        raise ValueError(f"{path}: no YAML: {error.problem}" + (f", in line {mark.line + 1}" if mark else "")) from None
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


@contextlib.contextmanager
def new_file(path, mode=0o644):
    """A binary file to write to, which takes the place of `path` at the end of the `with`; none on an exception.

    It has this mode whatever was there, and is on the disk before it takes the place; a link itself is replaced.
    """
    path = Path(path)
    _refuse_other(path)
    handle, beside = tempfile.mkstemp(dir=str(path.parent), prefix=".new_")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fchmod(handle, mode)
            os.fsync(handle)
        os.replace(beside, str(path))
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(beside)
        raise
    flush_folder(path.parent)


def write_file(path, text, mode=0o644):
    """Write a text as UTF-8 (or bytes), by `new_file`."""
    with new_file(path, mode) as file:
        file.write(text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape"))


def read_file(path, most):
    """The bytes of a file. Raises OSError, also where it is a pipe or a device or has more than `most` bytes."""
    _refuse_other(path)
    with open(str(path), "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes", str(path))
    return data


def _refuse_other(path):
    """Raise OSError where a path is there and leads to no file: a pipe waits for ever, a device would be replaced."""
    if os.path.exists(str(path)) and not os.path.isfile(str(path)):
        raise OSError(errno.EINVAL, "it is no file", str(path))


@contextlib.contextmanager
def alone_in(folder):
    """While the block lasts no other process is in such a block for this folder, which is made where it is missing."""
    os.makedirs(str(folder), exist_ok=True)
    handle = os.open(str(folder), os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def flush_folder(folder):
    """Bring a folder's list of names to the disk."""
    handle = os.open(str(folder), os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
