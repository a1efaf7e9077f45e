"""./robotont network: finds out in 5 s why two machines of one ROS 1 system do not hear each other, with the remedy."""

import argparse
import os
import sys
import time
from concurrent.futures import wait

from robotont_operations import probes
from robotont_operations.network_check.announced_address import announced_by, check_announced
from robotont_operations.network_check.clock import check_clock
from robotont_operations.network_check.findings import FAULT, NOTE, Finding
from robotont_operations.network_check.master import LOST_MASTER, Master
from robotont_operations.network_check.other_nodes import check_nodes
from robotont_operations.network_check.way_back import FAREWELL, WayBack

BUDGET = 4.0  # [s] that all checks together may take: beyond it what has not come is reported as not checked


class NetworkCheck:
    """The checks from this machine: first the master, then all others at once."""

    def __init__(self, environment):
        self._environment = environment
        self._way_back = None
        self._jobs = []  # (what is checked, its Findings, its Future)

    def run(self):
        """List of Findings, within the budget."""
        end = time.monotonic() + BUDGET
        master = Master(self._environment)
        findings = [master.find()]
        if master.address is None:
            return findings
        is_here = probes.is_own(master.address)
        own = "127.0.0.1" if is_here else probes.own_address_towards(master.address)
        others = self._begin("nodes of other machines", self._check_nodes, master, is_here)
        self._begin("what this machine announces", check_announced, self._environment, own, is_here, others)
        if not is_here:
            self._way_back = WayBack(master, announced_by(self._environment), own)
            self._begin("whether the master's machine reaches this one", self._way_back.check)
            self._begin(f"the clock of {master.address}", check_clock, master.address, master.port)
        for what, found, job in self._jobs:  # grows by the clocks of other machines
            done = wait([job], max(0.0, end - time.monotonic())).done
            findings += found
            if done:
                job.result()  # an error in the check itself is none of the network
            else:
                findings.append(Finding(NOTE, f"not checked: {what}: the other checks took too long: mend what they "
                                              "found, run it again"))
        return findings

    def cancel(self):
        """Let what is not finished end, the way back unregister itself."""
        if self._way_back:
            self._way_back.cancel()
        wait([job for _, _, job in self._jobs], FAREWELL)

    def _begin(self, what, work, *arguments):
        """The Future of `work(report, *arguments)`; what it reports is kept as it comes."""
        found = []
        job = probes.start(work, found.append, *arguments)
        self._jobs.append((what, found, job))
        return job

    def _check_nodes(self, report, master, master_is_here):
        """Whether nodes of other machines answer; begins the checks of their clocks."""
        try:
            nodes = master.nodes()
        except probes.RPC_ERRORS:
            report(LOST_MASTER)
            return False
        others = check_nodes(report, nodes, master.address, master_is_here)
        ports = {address: node.port for node, address in others.items() if master_is_here or address != master.address}
        for address, port in ports.items():
            self._begin(f"the clock of {address}", check_clock, address, port)
        if master_is_here and not others:
            report(Finding(NOTE, "no node of another machine is registered here: run ./robotont network there, too"))
        return bool(others)


def main():
    """Run the check; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="./robotont network", description="Check from this machine, robot or laptop, whether ROS 1 nodes of two "
        "machines can hear each other: addresses, names, firewalls, clocks, both directions. Takes at most 5 s.",
        epilog="exit status: 0 no fault; 1 at least one")
    parser.parse_args()
    check = NetworkCheck(os.environ)
    try:
        findings = check.run()
        check.cancel()
    except KeyboardInterrupt:
        check.cancel()
        os._exit(130)
    for level, words in findings:
        print(f"{level:5}  {words}")
    sys.stdout.flush()
    os._exit(any(level == FAULT for level, _ in findings))  # resolvers that still wait must not hold this up
