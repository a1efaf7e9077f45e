"""The address that this machine's nodes announce: where others look for them, and whether that can be right."""

import rosgraph.network

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, NOTE, Finding


def announced_by(environment):
    """The address or name under which this machine's nodes will be looked for."""
    return environment.get("ROS_HOSTNAME") or environment.get("ROS_IP") or rosgraph.network.get_host_name()


def check_announced(report, environment, own, master_is_here, others):
    """Report whether what this machine announces can be right.

    own: its address towards the master; others: a Future of whether nodes of other machines answer.
    """
    announced = announced_by(environment)
    set_by = "ROS_HOSTNAME" if environment.get("ROS_HOSTNAME") else "ROS_IP"
    value = environment.get(set_by, "")
    remedy = f"export ROS_IP={own}" + ("" if set_by == "ROS_IP" else " and unset ROS_HOSTNAME")
    if master_is_here:
        remedy = "set ROS_IP to this machine's address in the other's network (ip address)"
    source = f"{set_by}={value}" if value else f"ROS_IP is not set: the host name {announced!r}"
    address = probes.resolve(announced)
    if address is None:
        fault = f"{source} cannot be resolved even here"
    elif not probes.is_own(address):
        fault = f"{source} ({address}) is no address of this machine"
    elif not probes.is_loopback(address):
        report(Finding(GOOD, f"this machine announces {announced}"))
        return
    elif not master_is_here:
        fault = f"{source} is {address}, where the robot finds only itself"
    elif others.result():
        fault = f"{source} is {address}, where other machines' nodes find only themselves"
    else:
        report(Finding(NOTE, f"this machine keeps to itself: its nodes announce {announced} ({address}), which no "
                             "other machine can use; on a robot ./robotont install-robot --network ADDRESS opens it"))
        return
    report(Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {fault}: {remedy}"))
