"""The nodes of other machines: whether this one finds and reaches them, and what keeps it from that."""

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, NOTE, Finding, let_this_machine_in
from robotont_operations.network_check.master import CALLER


def check_nodes(report, nodes, master_address, master_is_here):
    """{node: address} of the nodes on other machines that answer. Reports on these and the others there."""
    hosts = sorted({node.host for node in nodes})
    found = dict(zip(hosts, probes.all_in_time(probes.resolve, hosts, 1.1)))
    for host in hosts:
        names = _list([node.name for node in nodes if node.host == host])
        if found[host] is None:
            report(Finding(FAULT, f"unresolvable name: {names} can be found at {host!r} only, which this machine "
                                  f"cannot resolve: on that machine, export ROS_IP=ITS_ADDRESS, or add a line "
                                  f"'ADDRESS {host}' to /etc/hosts here"))
        elif probes.is_loopback(found[host]) and not master_is_here:
            report(Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {names} can be found at {host!r} only, which is every "
                                  f"machine's own: on that machine, export ROS_IP=ITS_ADDRESS ({master_address} if "
                                  "they run beside the master)"))
    away = [node for node in nodes if found[node.host] and not probes.is_loopback(found[node.host])
            and not probes.is_own(found[node.host])]
    outcomes = probes.all_in_time(lambda node: _outcome(node, found[node.host]), away, 1.3)
    outcomes = {node: outcome or probes.SILENT for node, outcome in zip(away, outcomes)}
    _explain(report, outcomes, found, master_address)
    return {node: found[node.host] for node, outcome in outcomes.items() if outcome == probes.OPEN}


def _outcome(node, address):
    """As `probes.reach`: of the node's own port, then of the one that its topics come from."""
    outcome = probes.reach(address, node.port)
    if outcome != probes.OPEN:
        return outcome
    try:
        answer = probes.remote(f"http://{address}:{node.port}", 1.0).requestTopic(CALLER, "/rosout", [["TCPROS"]])
    except probes.RPC_ERRORS:
        return probes.SILENT
    return probes.reach(address, answer[2][2]) if answer[0] == 1 and answer[2] else outcome  # some publish no log


def _explain(report, outcomes, found, master_address):
    """Report on {node: outcome}, once for the nodes of a machine with the same outcome; found: {host: address}."""
    groups = {}
    for node, outcome in outcomes.items():
        groups.setdefault((node.host, outcome), []).append(node.name)
    doubtful = sorted({found[host] for host, outcome in groups if outcome not in {probes.OPEN, probes.REFUSED}}
                      - {master_address})
    there = {master_address: True, **dict(zip(doubtful, probes.all_in_time(probes.is_there, doubtful, 1.0)))}
    for (host, outcome), members in groups.items():
        names, address = _list(members), found[host]
        remedy = "on that machine, " + let_this_machine_in(address)
        if outcome == probes.OPEN:
            report(Finding(GOOD, f"an answer of {names} on {host}"))
        elif outcome == probes.REFUSED and address == master_address and (host, probes.OPEN) not in groups:
            report(Finding(FAULT, f"firewall that rejects, or nodes that are gone: {names} on {host}, where the master "
                                  f"answers: rosnode cleanup removes what is gone; what runs needs, {remedy}"))
        elif outcome == probes.REFUSED:
            report(Finding(NOTE, f"{names} on {host}: registered, but gone, or behind a firewall that rejects: rosnode "
                                 f"cleanup removes what is gone; what runs needs, {remedy}"))
        elif there[address]:
            report(Finding(FAULT, f"firewall: {host} answers, but not at the ports of {names}: {remedy}"))
        else:
            report(Finding(FAULT, f"one-way traffic, or wrong ROS_IP/ROS_HOSTNAME there: {names} registered as "
                                  f"{address}, where nothing answers: on that machine, export ROS_IP=ITS_ADDRESS; if "
                                  f"that is {address}, {let_this_machine_in(address)}"))


def _list(names):
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if names[3:] else "")
