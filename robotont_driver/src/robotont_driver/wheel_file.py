"""wheel_params.yaml as text: new values in the old lines, so that order and comments stay."""

import re


def with_values(text, parameters, note):
    """`text` of a wheel_params.yaml with the values of `parameters` in it and a comment `note` on top.

    Only keys whose value has changed are touched. A key that stands over several lines is put on one. Raises
    ValueError when a changed key is not there.
    """
    import yaml  # here, for the nodes do not need it

    old = yaml.safe_load(text)
    for key, value in parameters.items():
        if old.get(key) != value:
            # the value: to the comment or the end of the line; then lines that only go on with it
            pattern = re.compile(rf"^({key}:[ \t]*)([^#\n]*?)([ \t]*#[^\n]*)?\n((?:[ \t]+[^\n]*\n|- [^\n]*\n)*)", re.M)
            text = text if text.endswith("\n") else text + "\n"
            found = pattern.search(text)
            if not found:
                raise ValueError(f"found no line of {key}")
            comment = (" " if (found[3] or "").startswith("#") else "") + (found[3] or "")
            text = text[:found.start()] + found[1] + written(value) + comment + "\n" + text[found.end():]
    return "".join(f"# {line}\n" for line in note.splitlines()) + text


def written(value):
    """A number or list of numbers as YAML, to a tenth of a micrometre or microradian."""
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(written, value)) + "]"
    return repr(round(value, 7))
