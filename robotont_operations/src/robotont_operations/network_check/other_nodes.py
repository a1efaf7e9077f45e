"""The nodes of other machines: whether this one finds and reaches them, and what keeps it from that."""

import time

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, NOTE, Finding, let_this_machine_in, not_checked
from robotont_operations.network_check.master import CALLER
from robotont_operations.network_check.time_budget import WORTHWHILE


def check_nodes(nodes, master_address, master_is_here, budget):
    """({node: address} of the nodes on other machines that answer, Findings about these and the others there)."""
    hosts = sorted({node.host for node in nodes})
    if hosts and budget.is_spent():
        return {}, [not_checked("nodes on " + _list(hosts))]
    timeout = budget.left(1.2)
    found = dict(zip(hosts, probes.all_in_time(lambda host: probes.resolve(host, timeout), hosts, timeout + 0.1)))
    findings = []
    for host in hosts:
        names = _list([node.name for node in nodes if node.host == host])
        if found[host] is None:
            findings.append(Finding(FAULT, f"unresolvable name: {names} can be found at {host!r} only, which this "
                                           "machine cannot resolve: start them with ROS_IP=THEIR_ADDRESS, or add "
                                           f"'ADDRESS {host}' to /etc/hosts"))
        elif probes.is_loopback(found[host]) and not master_is_here:
            findings.append(Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {names} call{_s(names)} the machine {host!r}, "
                                           "which is every machine's own: start them with ROS_IP=THEIR_ADDRESS "
                                           f"({master_address} if they run beside the master)"))
    away = [node for node in nodes if found[node.host] and not probes.is_loopback(found[node.host])
            and not probes.is_own(found[node.host])]
    if away and budget.is_spent():
        return {}, [*findings, not_checked(_list([node.name for node in away]))]
    timeout = budget.left(1.2)
    outcomes = probes.all_in_time(lambda node: _outcome(node, found[node.host], timeout), away, timeout + 0.1)
    outcomes = {node: outcome or probes.SILENT for node, outcome in zip(away, outcomes)}
    findings += _explain(outcomes, found, master_address, budget)
    return {node: found[node.host] for node, outcome in outcomes.items() if outcome == probes.OPEN}, findings


def _outcome(node, address, timeout):
    """As `probes.reach`: of the node's own port, then of the one that its topics come from."""
    end = time.monotonic() + timeout
    outcome = probes.reach(address, node.port, timeout)
    if outcome != probes.OPEN:
        return outcome
    try:
        answer = probes.remote(f"http://{address}:{node.port}", max(0.1, end - time.monotonic())).requestTopic(
            CALLER, "/rosout", [["TCPROS"]])
    except probes.RPC_ERRORS:
        return probes.SILENT
    if answer[0] == 1 and answer[2]:
        return probes.reach(address, answer[2][2], max(0.1, end - time.monotonic()))
    return outcome  # a node that publishes no log


def _explain(outcomes, found, master_address, budget):
    """Findings about {node: outcome}, one for the nodes of a machine with the same outcome; found: {host: address}."""
    groups = {}
    for node, outcome in outcomes.items():
        groups.setdefault((node.host, outcome), []).append(node.name)
    doubtful = sorted({found[host] for host, outcome in groups if outcome not in {probes.OPEN, probes.REFUSED}}
                      - {master_address})
    timeout = budget.left(0.8)
    there = dict(zip(doubtful, probes.all_in_time(lambda each: probes.is_there(each, timeout), doubtful,
                                                  timeout + 0.2)))
    findings = []
    for (host, outcome), members in groups.items():
        names, address = _list(members), found[host]
        if outcome == probes.OPEN:
            findings.append(Finding(GOOD, f"{names} on {host} answer{_s(names)}"))
        elif outcome == probes.REFUSED:
            alone = (host, probes.OPEN) not in groups
            findings.append(_refused(host, names, address, alone and address == master_address))
        elif address in doubtful and timeout < WORTHWHILE:
            findings.append(not_checked(names))
        else:
            findings.append(_silent(host, names, address, there.get(address, True)))
    return findings


def _refused(host, names, address, beside_the_master):
    """Finding about a refusal, by dead nodes or a firewall; none but these answer `beside_the_master`, which does."""
    remedy = ("rosnode cleanup removes what is gone; what runs needs, on that machine, "
              + let_this_machine_in(address))
    if beside_the_master:
        return Finding(FAULT, f"firewall that rejects, or nodes that are gone: {names} on {host} refuse{_s(names)}, "
                              f"the master there answers: {remedy}")
    return Finding(NOTE, f"{names} on {host}: registered, but gone, or behind a firewall that rejects: {remedy}")


def _silent(host, names, address, is_there):
    """Finding about nodes without an answer; is_there: whether their machine gives one elsewhere."""
    if is_there:
        return Finding(FAULT, f"firewall: {host} answers, but not at the ports of {names}: on that machine, "
                              + let_this_machine_in(address))
    return Finding(FAULT, f"one-way traffic, or wrong ROS_IP/ROS_HOSTNAME there: {names} registered as {address}, "
                          f"where nothing answers: on that machine, export ROS_IP=ITS_ADDRESS; if that is "
                          f"{address}, {let_this_machine_in(address)}")


def _list(names):
    return names[0] if len(names) == 1 else ", ".join(names[:3]) + (f" and {len(names) - 3} more" if names[3:] else "")


def _s(names):
    return "" if "," in names or " and " in names else "s"
