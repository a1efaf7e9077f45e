"""Removes secrets from data that is handed to others: all that stands behind a name that means a secret.

A name means a secret when it holds one of the words in _ANYWHERE, or ends with one of _LAST, as "access_key" and
"dbPass" do, but not "keyboard", "monkey" or "KeyError"; unless it names a place, as "token_file" does. Of a text, the
rest of the line goes, and the lines below it that are indented further: rather too much than too little.
"""

import re

REMOVED = "(removed)"
_ANYWHERE = (r"(?:pass(?:word|wd|phrase|code)|secret|token|credential|cookie|authorization|"
             r"(?:private|api|access)[_-]?key)")
_LAST = r"(?:(?<![a-z])|(?-i:(?<=[a-z])(?=[A-Z])))(?:key|pass|pwd|pw|auth|login|psk|session|pin_?code)s?(?![\w-])"
_NAME = re.compile(rf"(?P<sure>{_ANYWHERE}[\w./-]*)|{_LAST}", re.IGNORECASE)
_PLACE = re.compile(r"[\w./-]*[_.-](?:file|path|folder|dir)s?", re.IGNORECASE)
_VALUE = re.compile(r"[\"']?\s*[:=>]|\s+(?:is|was)\s")  # what stands between a name that is less sure and its value
_KEY = re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----.*?(?:-----END [A-Z ]*PRIVATE KEY-----|\Z)", re.DOTALL)
_HEADER = re.compile(r"(?P<name>\b(?:bearer|basic)\s+)[\w.~+/=-]{8,}", re.IGNORECASE)
_LOGIN = re.compile(r"(?P<name>(?<!\w)\w+://[^\s/:@]*):[^\s/@]+@")
_PICTURE = re.compile("[█▀▄][█▀▄ ]{15,}")  # a line of a QR code: the page's address with its token
_SUSPICIOUS = re.compile(rf"{_NAME.pattern}|{_HEADER.pattern.replace('name', 'header')}|://[^/]*@|PRIVATE KEY",
                         re.IGNORECASE)


def clean_text(text):
    """The string with passwords, tokens and keys replaced."""
    text = _PICTURE.sub(REMOVED, _KEY.sub(REMOVED, text))
    lines, hidden = [], None  # hidden: how far the line of the newest secret is indented
    for line in text.splitlines(keepends=True):
        indented = len(line) - len(line.lstrip(" \t"))
        if hidden is not None and indented > hidden:
            continue
        end = _end_of_name(line)
        hidden = None if end is None else indented
        kept = line if end is None else f"{line[:end]} {REMOVED}" + line[len(line.rstrip("\r\n")):]
        lines.append(_LOGIN.sub(rf"\g<name>:{REMOVED}@", _HEADER.sub(rf"\g<name>{REMOVED}", kept)))
    return "".join(lines)


def _end_of_name(line):
    """Index in a line behind the first name that means a secret, and its sign, where more follows; else None."""
    for match in _NAME.finditer(line):
        value = _VALUE.match(line, match.end())
        option = line[max(0, match.start() - 80):match.end()].rsplit(None, 1)[-1].startswith("--")
        if (match["sure"] or value or option) and not _PLACE.fullmatch(match.group()) and line[match.end():].strip():
            return value.end() if value else match.end()
    return None


def clean_parameters(value):
    """Parameters (dictionaries, lists, plain values) with the secret ones replaced; switches stay."""
    if isinstance(value, dict):
        return {name: REMOVED if _means_a_secret(str(name)) and not isinstance(entry, bool)
                else clean_parameters(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [clean_parameters(entry) for entry in value]
    return clean_text(value) if isinstance(value, str) else value


def _means_a_secret(name):
    return _NAME.search(name) is not None and not _PLACE.fullmatch(name)


def clean_message(message):
    """Replace secrets in all strings of a ROS message, in place; of a diagnostic_msgs/KeyValue by its key."""
    if hasattr(message, "key") and _means_a_secret(str(message.key)):
        message.value = REMOVED
    for slot in message.__slots__:
        value = getattr(message, slot)
        if isinstance(value, str):
            setattr(message, slot, clean_text(value))
        elif isinstance(value, list) and value and isinstance(value[0], str):
            setattr(message, slot, [clean_text(text) for text in value])
        else:
            for part in value if isinstance(value, list) else [value]:
                if hasattr(part, "__slots__"):
                    clean_message(part)


def may_hold_secrets(data):
    """Whether a serialised message, bytes, has to be looked at."""
    return _SUSPICIOUS.search(data.decode("latin-1")) is not None
