"""Files of YAML that people write by hand: read with a message for every error in them."""

from pathlib import Path

import yaml

from robotont_driver.parameters.parameters import fault


def read_mapping(path, allowed):
    """(mapping, text) of a YAML file that contains one, or nothing; allowed: description of what it should contain.

    Raises ValueError with the error: no UTF-8, no YAML, too deep, no mapping. Raises OSError where it cannot be read.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        content = yaml.safe_load(text)
    except UnicodeDecodeError as error:
        line, byte = error.object.count(b"\n", 0, error.start) + 1, error.object[error.start]
        raise ValueError(f"{path}: found the byte 0x{byte:02x} in line {line}, allowed: text in UTF-8") from None
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:  # also of dates: 2026-13-45
        raise ValueError(f"{path}: no YAML: {error}") from None
    if content is None:
        content = {}
    if not isinstance(content, dict):
        raise ValueError(fault(str(path), content, allowed))
    return content, text
