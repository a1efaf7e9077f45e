"""Findings: the lines that the network check reports."""

from typing import NamedTuple

GOOD, NOTE, FAULT = "ok", "note", "FAULT"


class Finding(NamedTuple):
    """One line: its level, GOOD, NOTE or FAULT, and a message; that of a fault ends with the remedy."""

    level: str
    words: str


def not_checked(what):
    """Finding that there was no time to check something."""
    return Finding(NOTE, f"not checked: {what}: the other checks took too long: mend what they found, run it again")
