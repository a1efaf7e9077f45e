"""Finds out in 5 s why two machines of one ROS 1 system do not hear each other, and shows the remedy."""

import argparse
import contextlib
import os
import sys
import threading
import time
import xmlrpc.client
import xmlrpc.server
from typing import NamedTuple
from urllib.parse import urlsplit

import rosgraph.network

from robotont_operations import probes
from robotont_operations.colours import GREEN, RED, YELLOW, paint

BUDGET = 4.0              # [s] that all checks together may take
CLOCK_TOLERANCE = 0.2     # [s] between two clocks; tf's listeners wait about as long for a transform
FAREWELL = 0.4            # [s] before the end of the budget, in which the way back unregisters itself
WORTHWHILE = 0.5          # [s] that a probe needs at least: what has less is not begun, and reported as not checked
CALLER = "/robotont_network"
GOOD, NOTE, FAULT = "ok", "note", "FAULT"
RPC_ERRORS = (OSError, xmlrpc.client.Error)
WAY_BACK = "whether the master's machine reaches this one"
LOST_MASTER = "master unreachable: it stopped answering in mid-check: check the Wi-Fi or the cable"


class Finding(NamedTuple):
    """One line: its level, GOOD, NOTE or FAULT, and a message; that of a fault ends with the remedy."""

    level: str
    words: str


class Node(NamedTuple):
    """A node of the system: its name, and its announced address."""

    name: str
    host: str
    port: int


class NetworkCheck:
    """The checks from this machine, in the order in which one fault hides the next."""

    def __init__(self, environment, budget=BUDGET):
        self._environment = environment
        self._end = time.monotonic() + budget
        self._called = threading.Event()
        self._beside = []  # (what is checked, its Job), beside the questions to the nodes, each of which may take long
        self.findings = []

    def cancel(self):
        """Let the way back end at once, and unregister itself."""
        self._called.set()
        for _, job in self._beside:
            job.wait(FAREWELL)

    def run(self):
        """List of Findings; takes at most the budget."""
        address = self._find_master()
        if address is None:
            return self.findings
        master_is_here = probes.is_own(address)
        own = "127.0.0.1" if master_is_here else probes.own_address_towards(address)
        self._announced = self._announces()
        self._beside = [] if master_is_here else [
            (WAY_BACK, probes.Job(self._way_back, own, address)),
            (f"the clock of {address}", probes.Job(self._clock, address, urlsplit(self._uri).port))]
        others = self._check_nodes(self._nodes(), address, master_is_here)
        self._check_announced(own, master_is_here, others)
        clocks = set() if master_is_here else {address}
        for node, where in others.items():
            if where not in clocks:
                clocks.add(where)
                self._beside.append((f"the clock of {where}", probes.Job(self._clock, where, node.port)))
        for what, job in self._beside:
            finished, finding = job.wait(self._left())
            if not finished:
                self._say(*_not_checked(what))
            elif finding:
                self.findings.append(finding)
        if master_is_here and not others:
            self._say(NOTE, "no node of another machine is registered here: run ./robotont network there, too")
        return self.findings

    def _left(self, most=BUDGET):
        return max(0.05, min(most, self._end - time.monotonic()))

    def _too_late(self, what):
        """Whether there is no time left to check something; then says so."""
        if self._left() >= WORTHWHILE:
            return False
        self._say(*_not_checked(what))
        return True

    def _say(self, level, words):
        self.findings.append(Finding(level, words))

    # the master

    def _find_master(self):
        """Address of a master that answers, or None once the fault is reported."""
        self._uri = self._environment.get("ROS_MASTER_URI", "").rstrip("/") or "http://localhost:11311"
        try:
            host, port = urlsplit(self._uri).hostname, urlsplit(self._uri).port
        except ValueError:
            host = port = None
        if not host or not port or not self._uri.startswith("http://"):
            return self._say(FAULT, f"wrong ROS_MASTER_URI: {self._uri!r} is no http://HOST:PORT: "
                                    "export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:11311")
        address = probes.resolve(host, self._left(1.5))
        if address is None:
            return self._say(FAULT, f"unresolvable name: this machine finds no address of {host!r} (ROS_MASTER_URI): "
                                    f"export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:{port}, or add a line "
                                    f"'ADDRESS {host}' to /etc/hosts")
        where = f"{host} ({address})" if host != address else address
        fault = self._unreachable(where, address, port) or self._no_master(where, port)
        if fault:
            return self._say(FAULT, fault)
        self._say(GOOD, f"the master answers at {self._uri}")
        return address

    def _unreachable(self, where, address, port):
        """A message when no connection to the master's port is possible; else None."""
        outcome = probes.reach(address, port, self._left(1.2))
        if outcome == probes.OPEN:
            return None
        if outcome == probes.REFUSED:
            if probes.is_loopback(address):
                return (f"master unreachable: no process listens at port {port} of this machine itself "
                        f"(ROS_MASTER_URI{'=' if self._environment.get('ROS_MASTER_URI') else ' is not set: '}"
                        f"{self._uri}): on a laptop: export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:{port}; "
                        "on the robot: start the stack")
            return (f"master unreachable: {where} answers, but no process listens at port {port}, or a firewall there "
                    "rejects: start the robot's stack there; if it runs, it keeps to itself (ROS_IP=127.0.0.1): "
                    "./robotont install-robot --network ADDRESS there; if it does so with that, on that machine, sudo "
                    f"ufw allow from {probes.own_address_towards(address)} (ROS 1 needs all TCP ports above 1023)")
        if outcome == probes.NO_ROUTE:
            return (f"master unreachable: this machine has no way to {where}: plug in the cable or join the robot's "
                    "Wi-Fi, then look at 'ip address'")
        if probes.is_there(address, self._left(1.0)):
            return (f"firewall: {where} answers, but not at port {port}: on that machine, sudo ufw allow from "
                    f"{probes.own_address_towards(address)} (ROS 1 needs all TCP ports above 1023)")
        return (f"master unreachable: no answer from {where}: is it switched on, in this network, its cable in? "
                f"ping {address}")

    def _no_master(self, where, port):
        """A message when the answer is not that of a ROS master; else None."""
        try:
            code, words, _ = probes.remote(self._uri, self._left(1.0)).getPid(CALLER)
        except RPC_ERRORS as error:
            code, words = -1, str(error)
        return None if code == 1 else (f"master unreachable: {where} port {port} answers, but not as a ROS master "
                                       f"({words}): check the port in ROS_MASTER_URI")

    def _nodes(self):
        """Nodes that the master lists, but for those of this program."""
        answers = []

        def ask():
            master = probes.remote(self._uri, self._left(1.0))
            state = master.getSystemState(CALLER)[2]
            names = {name for kind in state for _, names in kind for name in names if not name.startswith(CALLER)}
            for name in sorted(names):
                answers.append((name, master.lookupNode(CALLER, name)))
        try:
            finished, _ = probes.in_time(ask, self._left(1.2))
        except RPC_ERRORS:
            self._say(FAULT, LOST_MASTER)
            return []
        if not finished:
            self._say(*_not_checked("all nodes that the master lists" if not answers else
                                    f"the nodes that the master lists behind {answers[-1][0]}"))
        split = [(name, urlsplit(answer[2])) for name, answer in list(answers) if answer[0] == 1]
        return [Node(name, uri.hostname, uri.port) for name, uri in split if uri.hostname and uri.port]

    # the nodes of other machines

    def _check_nodes(self, nodes, master, master_is_here):
        """{node: address} of the nodes on other machines that answer; reports the reason for the rest."""
        hosts = sorted({node.host for node in nodes})
        if hosts and self._too_late("nodes on " + _list(hosts)):
            return {}
        timeout = self._left(1.2)
        found = dict(zip(hosts, probes.all_in_time(lambda host: probes.resolve(host, timeout), hosts, timeout + 0.1)))
        for host in hosts:
            names = _list([node.name for node in nodes if node.host == host])
            address = found[host]
            if address is None:
                self._say(FAULT, f"unresolvable name: {names} can be found at {host!r} only, which this machine cannot "
                                 f"resolve: start them with ROS_IP=THEIR_ADDRESS, or add 'ADDRESS {host}' "
                                 "to /etc/hosts")
            elif probes.is_loopback(address) and not master_is_here:
                self._say(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {names} call{_s(names)} the machine {host!r}, which "
                                 f"is every machine's own: start them with ROS_IP=THEIR_ADDRESS "
                                 f"({master} if they run beside the master)")
        away = [node for node in nodes if found[node.host] and not probes.is_loopback(found[node.host])
                and not probes.is_own(found[node.host])]
        if away and self._too_late(_list([node.name for node in away])):
            return {}
        timeout = self._left(1.2)
        outcomes = probes.all_in_time(lambda node: _node_outcome(node, found[node.host], timeout), away, timeout + 0.1)
        groups = {}
        for node, outcome in zip(away, outcomes):
            groups.setdefault((node.host, outcome or probes.SILENT), []).append(node)
        doubtful = sorted({found[host] for host, outcome in groups if outcome not in {probes.OPEN, probes.REFUSED}}
                          - {master})
        timeout = self._left(0.8)
        there = dict(zip(doubtful, probes.all_in_time(lambda each: probes.is_there(each, timeout), doubtful,
                                                      timeout + 0.2)))
        for (host, outcome), members in groups.items():
            names = _list([node.name for node in members])
            if outcome == probes.REFUSED:
                alone = not any(node.host == host for node, other in zip(away, outcomes) if other == probes.OPEN)
                self._tell_refused(host, names, found[host], alone and found[host] == master)
            elif outcome != probes.OPEN and found[host] in doubtful and timeout < WORTHWHILE:
                self._say(*_not_checked(names))
            else:
                self._tell_nodes(host, found[host], outcome, names, there.get(found[host], True))
        return {node: found[node.host] for node, outcome in zip(away, outcomes) if outcome == probes.OPEN}

    def _tell_nodes(self, host, address, outcome, names, is_there):
        if outcome == probes.OPEN:
            self._say(GOOD, f"{names} on {host} answer{_s(names)}")
        elif is_there:
            mine = probes.own_address_towards(address)
            self._say(FAULT, f"firewall: {host} answers, but not at the ports of {names}: on that machine, sudo "
                             f"ufw allow from {mine} (ROS 1 needs all TCP ports above 1023)")
        else:
            self._say(FAULT, f"one-way traffic, or wrong ROS_IP/ROS_HOSTNAME there: {names} registered as {address}, "
                             f"where nothing answers: on that machine, export ROS_IP=ITS_ADDRESS; if that is "
                             f"{address}, sudo ufw allow from {probes.own_address_towards(address)}")

    def _tell_refused(self, host, names, address, beside_the_master):
        """A refusal: of dead nodes, or by a firewall; none but these answer `beside_the_master`, which does."""
        remedy = (f"rosnode cleanup removes what is gone; what runs needs, on that machine, sudo ufw allow from "
                  f"{probes.own_address_towards(address)} (ROS 1 needs all TCP ports above 1023)")
        if beside_the_master:
            self._say(FAULT, f"firewall that rejects, or nodes that are gone: {names} on {host} refuse{_s(names)}, the "
                             f"master there answers: {remedy}")
        else:
            self._say(NOTE, f"{names} on {host}: registered, but gone, or behind a firewall that rejects: {remedy}")

    # this machine, as others see it

    def _announces(self):
        """The address or name under which this machine's nodes will be looked for."""
        return (self._environment.get("ROS_HOSTNAME") or self._environment.get("ROS_IP")
                or rosgraph.network.get_host_name())

    def _check_announced(self, own, master_is_here, others):
        """Report whether what this machine announces can be right."""
        set_by = "ROS_HOSTNAME" if self._environment.get("ROS_HOSTNAME") else "ROS_IP"
        announced = self._environment.get(set_by, "")
        remedy = f"export ROS_IP={own}" + ("" if set_by == "ROS_IP" else " and unset ROS_HOSTNAME")
        if master_is_here:
            remedy = "set ROS_IP to this machine's address in the other's network (ip address)"
        source = f"{set_by}={announced}" if announced else "ROS_IP is not set: the host name"
        if self._too_late(f"what this machine announces, {self._announced}"):
            return
        address = probes.resolve(self._announced, self._left(1.0))
        if address is None:
            self._say(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {source} {'' if announced else repr(self._announced) + ' '}"
                             f"cannot be resolved even here: {remedy}")
        elif not probes.is_own(address):
            self._say(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {source} ({address}) is no address of this machine: "
                             f"{remedy}")
        elif probes.is_loopback(address) and not master_is_here:
            self._say(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {source} {'' if announced else repr(self._announced) + ' '}"
                             f"is {address}, where the robot finds only itself: {remedy}")
        elif probes.is_loopback(address) and others:
            self._say(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {source} is {address}, where other machines' nodes "
                             f"find only themselves: {remedy}")
        elif probes.is_loopback(address):
            self._say(NOTE, f"this machine keeps to itself: its nodes announce {self._announced} ({address}), which "
                            "no other machine can use; on a robot ./robotont install-robot --network ADDRESS opens it")
        else:
            self._say(GOOD, f"this machine announces {self._announced}")

    def _way_back(self, own, master):
        """Finding of whether the master can call this machine, as it does whenever a topic gets a new publisher.

        None where what this machine announces cannot be right.
        """
        announced = probes.resolve(self._announced, self._left(1.0))
        if announced is None or probes.is_loopback(announced) or not probes.is_own(announced):
            return None
        server = xmlrpc.server.SimpleXMLRPCServer(("0.0.0.0", 0), logRequests=False)
        server.register_function(lambda *_: self._called.set() or (1, "", 0), "publisherUpdate")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            heard = self._is_called(f"http://{self._announced}:{server.server_address[1]}/")
        except RPC_ERRORS:
            return Finding(FAULT, LOST_MASTER)
        finally:
            server.shutdown()
            server.server_close()
        if heard:
            return Finding(GOOD, "the master's machine reaches this one")
        if heard is None:
            return _not_checked(WAY_BACK)
        if self._announced == own:
            return Finding(FAULT, f"one-way traffic: this machine reaches {master}, but not the other way round "
                                  f"(at {own}): on this machine, sudo ufw allow from {master}")
        return Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: the master's machine does not reach this one as "
                              f"{self._announced!r}: export ROS_IP={own}; if that does not help, "
                              f"sudo ufw allow from {master}")

    def _is_called(self, uri):
        """Whether the master calls this URI, registered meanwhile; None without the time to tell. Raises RPC_ERRORS."""
        topic, caller = f"{CALLER}/way_back_{os.getpid()}", f"{CALLER}_{os.getpid()}"
        until = self._end - FAREWELL
        calls = probes.remote(self._uri, max(0.05, min(1.0, until - time.monotonic())))
        try:
            calls.registerSubscriber(caller, topic, "std_msgs/Empty", uri)
            calls.registerPublisher(caller, topic, "std_msgs/Empty", uri)
            patience = min(1.5, until - time.monotonic())
            return self._called.wait(max(0.0, patience)) or (False if patience >= WORTHWHILE else None)
        finally:
            with contextlib.suppress(*RPC_ERRORS):
                farewell = probes.remote(self._uri, FAREWELL)
                farewell.unregisterSubscriber(caller, topic, uri)
                farewell.unregisterPublisher(caller, topic, uri)

    def _clock(self, address, port):
        """Finding about a machine's clock; None where its server shows none."""
        duration = min(1.1, self._left() - 0.2)
        if duration < 0.1:
            return _not_checked(f"the clock of {address}")
        measured = probes.clock_difference(address, port, duration)
        if measured is None:
            return None
        difference, uncertainty = measured
        if abs(difference) - uncertainty > CLOCK_TOLERANCE:
            return Finding(FAULT, f"clocks apart: that of {address} is {abs(difference):.1f} s "
                                  f"{'ahead of' if difference > 0 else 'behind'} this machine's: "
                                  "sudo apt-get install chrony on both (without internet: docs/network.md)")
        return Finding(GOOD, f"the clock of {address} agrees within {max(0.01, abs(difference) + uncertainty):.2f} s")


def _node_outcome(node, address, timeout):
    """As `probes.reach`: of the node's own port, then of the one that its topics come from."""
    end = time.monotonic() + timeout
    outcome = probes.reach(address, node.port, timeout)
    if outcome != probes.OPEN:
        return outcome
    try:
        answer = probes.remote(f"http://{address}:{node.port}", max(0.1, end - time.monotonic())).requestTopic(
            CALLER, "/rosout", [["TCPROS"]])
    except RPC_ERRORS:
        return probes.SILENT
    if answer[0] == 1 and answer[2]:
        return probes.reach(address, answer[2][2], max(0.1, end - time.monotonic()))
    return outcome  # a node that publishes no log


def _not_checked(what):
    return Finding(NOTE, f"not checked: {what}: the other checks took too long: mend what they found, run it again")


def _list(names):
    return names[0] if len(names) == 1 else ", ".join(names[:3]) + (f" and {len(names) - 3} more" if names[3:] else "")


def _s(names):
    return "" if "," in names or " and " in names else "s"


def main():
    """Run the check; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="network", description="Check from this machine, robot or laptop, whether ROS 1 nodes of two machines can "
        "hear each other: addresses, names, firewalls, clocks, both directions. Takes at most 5 s.",
        epilog="exit status: 0 no fault; 1 at least one")
    parser.parse_args()
    check = NetworkCheck(os.environ)
    try:
        findings = check.run()
    except KeyboardInterrupt:
        check.cancel()
        os._exit(130)
    colour = {GOOD: GREEN, NOTE: YELLOW, FAULT: RED}
    for level, words in findings:
        print(f"{paint(f'{level:5}', colour[level])}  {words}")
    sys.stdout.flush()
    os._exit(any(level == FAULT for level, _ in findings))  # resolvers that still wait must not hold this up
