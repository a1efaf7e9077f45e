"""Removes secrets from data that is handed to others."""

import re

REMOVED = "(removed)"
_NAME = r"[\w.-]*(?:password|passwd|passphrase|secret|token|api_?key|private_?key|credential|psk|pin_code)[\w.-]*"
_SECRET_NAME = re.compile(_NAME, re.IGNORECASE)
_ASSIGNMENT = re.compile(rf"(?P<name>{_NAME}[\"']?\s*[=:]\s*)(?P<value>\"[^\"]*\"|'[^']*'|[^\s&,;}}\]]+)",
                         re.IGNORECASE)
_BEARER = re.compile(r"(?P<name>(?:bearer|basic)\s+)[\w.~+/=-]{8,}", re.IGNORECASE)
_LOGIN = re.compile(r"(?P<name>\w+://[^\s/:@]*):[^\s/@]+@")
_KEY = re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----.*?-----END [A-Z ]*PRIVATE KEY-----", re.DOTALL)


def clean_text(text):
    """The string with passwords, tokens and keys replaced."""
    text = _KEY.sub(REMOVED, text)
    text = _ASSIGNMENT.sub(rf"\g<name>{REMOVED}", text)
    text = _BEARER.sub(rf"\g<name>{REMOVED}", text)
    return _LOGIN.sub(rf"\g<name>:{REMOVED}@", text)


def clean_parameters(value):
    """Parameters (dictionaries, lists, plain values) with the secret ones replaced."""
    if isinstance(value, dict):
        return {name: REMOVED if _SECRET_NAME.fullmatch(str(name)) and not isinstance(entry, (dict, bool))
                else clean_parameters(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [clean_parameters(entry) for entry in value]
    return clean_text(value) if isinstance(value, str) else value
