"""The address that this machine's nodes announce: where others look for them, and whether that can be right."""

import rosgraph.network

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, NOTE, Finding, not_checked


def announced_by(environment):
    """The address or name under which this machine's nodes will be looked for."""
    return environment.get("ROS_HOSTNAME") or environment.get("ROS_IP") or rosgraph.network.get_host_name()


def check_announced(announced, environment, own, master_is_here, others, budget):
    """Finding of whether what this machine announces can be right.

    own: its address towards the master; others: nodes of other machines that answer, if any.
    """
    set_by = "ROS_HOSTNAME" if environment.get("ROS_HOSTNAME") else "ROS_IP"
    value = environment.get(set_by, "")
    remedy = f"export ROS_IP={own}" + ("" if set_by == "ROS_IP" else " and unset ROS_HOSTNAME")
    if master_is_here:
        remedy = "set ROS_IP to this machine's address in the other's network (ip address)"
    source = f"{set_by}={value}" if value else "ROS_IP is not set: the host name"
    named = source if value else f"{source} {announced!r}"
    if budget.is_spent():
        return not_checked(f"what this machine announces, {announced}")
    address = probes.resolve(announced, budget.left(1.0))
    if address is None:
        fault = f"{named} cannot be resolved even here"
    elif not probes.is_own(address):
        fault = f"{source} ({address}) is no address of this machine"
    elif not probes.is_loopback(address):
        return Finding(GOOD, f"this machine announces {announced}")
    elif not master_is_here:
        fault = f"{named} is {address}, where the robot finds only itself"
    elif others:
        fault = f"{source} is {address}, where other machines' nodes find only themselves"
    else:
        return Finding(NOTE, f"this machine keeps to itself: its nodes announce {announced} ({address}), which "
                             "no other machine can use; on a robot ./robotont install-robot --network ADDRESS opens it")
    return Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {fault}: {remedy}")
