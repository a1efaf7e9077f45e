"""Files of YAML that people write by hand: read with bounds, and with a message for every error in them."""

import yaml

from robotont_driver.parameters.parameters import fault

LARGEST_FILE = 100000  # [bytes]
DEEPEST = 20           # lists within lists


def read_mapping(path, allowed):
    """(mapping, text) of a YAML file that contains one, or nothing; allowed: description of what it should contain.

    Raises ValueError with the error: no UTF-8, no YAML, too large or too deep, aliases, no mapping. Raises
    OSError where it cannot be read.
    """
    with open(str(path), "rb") as file:
        data = file.read(LARGEST_FILE + 1)
    if len(data) > LARGEST_FILE:
        raise ValueError(f"{path}: found more than {LARGEST_FILE} bytes, allowed: {allowed}")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(
            f"{path}: found the byte 0x{data[error.start]:02x} in line {line}, allowed: text in UTF-8") from None
    try:
        _check_structure(text)
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: no YAML: {error}") from None
    except (ValueError, OverflowError) as error:  # malformed numbers and dates, such as 2026-13-45
        raise ValueError(f"{path}: {error}") from None
    if content is None:
        content = {}
    if not isinstance(content, dict):
        raise ValueError(fault(str(path), content, allowed))
    return content, text


def _check_structure(text):
    """Raise ValueError for content that would exceed memory or stack before it could be checked."""
    depth = 0
    for event in yaml.parse(text, yaml.SafeLoader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError(f"found an alias (*{event.anchor}) in line {event.start_mark.line + 1}, "
                             "allowed: values written out")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEEPEST:
            raise ValueError(f"found more than {DEEPEST} lists within each other in line {event.start_mark.line + 1}, "
                             "allowed: plain lists")
