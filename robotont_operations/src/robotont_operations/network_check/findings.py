"""Findings: the lines that the network check reports."""

from typing import NamedTuple

from robotont_operations import probes

GOOD, NOTE, FAULT = "ok", "note", "FAULT"


class Finding(NamedTuple):
    """One line: its level, GOOD, NOTE or FAULT, and a message; that of a fault ends with the remedy."""

    level: str
    words: str


def let_this_machine_in(address):
    """The remedy for a firewall on the machine at an address, that keeps this one out."""
    own = probes.own_address_towards(address) or "THE_ADDRESS_OF_THIS_MACHINE"
    return f"sudo ufw allow from {own} (ROS 1 needs all TCP ports above 1023)"
