"""Rewrites a wheel_params.yaml with other values; order, comments and style stay."""

import io
import re

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import YAMLError


def with_values(text, parameters, note):
    """`text` of a wheel_params.yaml with the values of `parameters` in it and a comment `note` on top.

    Only values that have changed are touched: comments, order and style (lists in brackets or one item a line) stay.
    Raises ValueError rather than return a file that does not read back as exactly these values.
    """
    old = yaml.safe_load(text)
    changed = {key: rounded(value) for key, value in parameters.items() if old.get(key) != value}
    new = "".join(f"# {line}\n" for line in note.splitlines()) + _replaced(text, changed)
    try:
        found = yaml.safe_load(new)
    except yaml.YAMLError as error:
        raise ValueError(f"found a file that cannot be rewritten with its comments: {error}") from error
    if found != {**old, **changed}:
        wrong = [key for key in {**old, **changed} if found.get(key) != {**old, **changed}[key]]
        raise ValueError(f"found a file that reads back with another {', '.join(wrong)}, allowed: KEY: VALUE")
    return new


def _replaced(text, changed):
    """`text` with other values of some keys. Raises ValueError where it is no plain YAML."""
    # comments on top stay as they are: ruamel.yaml 0.17 cannot dump them before a mapping in braces
    head = re.match(r"(?:[ \t]*(?:#[^\n]*)?\n)*", text)[0]
    text = text[len(head):]
    document = YAML()
    document.preserve_quotes = True
    document.width = 4096  # long lists stay on their line
    dash = re.search(r"^( *)- ", text, re.MULTILINE)
    document.indent(mapping=2, sequence=2 + len(dash[1]) if dash else 2, offset=len(dash[1]) if dash else 0)
    stream = io.StringIO()
    try:
        data = document.load(text)
        for key, value in changed.items():
            before = data.get(key)
            if isinstance(value, list) and isinstance(before, list) and len(value) == len(before):
                for index, item in enumerate(value):  # one by one, for comments and style belong to the list
                    before[index] = item
            else:
                data[key] = _in_brackets(value) if isinstance(value, list) else value
        document.dump(data, stream)
    except (YAMLError, DuplicateKeyError) as error:  # two kinds in ruamel.yaml 0.15
        raise ValueError(f"found a file that cannot be rewritten with its comments: {error}") from error
    return head + stream.getvalue()


def _in_brackets(items):
    """A list that is written on one line."""
    made = CommentedSeq(items)
    made.fa.set_flow_style()
    return made


def rounded(value):
    """A number or list of numbers to a tenth of a micrometre or microradian."""
    return [rounded(item) for item in value] if isinstance(value, (list, tuple)) else round(value, 7)
