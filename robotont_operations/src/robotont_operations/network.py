"""./robotont network: finds out in 5 s why two machines of one ROS 1 system do not hear each other, with the remedy."""

import argparse
import os
import sys
from concurrent.futures import wait

from robotont_operations import probes
from robotont_operations.colours import GREEN, RED, YELLOW, paint
from robotont_operations.network_check.announced_address import announced_by, check_announced
from robotont_operations.network_check.clock import check_clock
from robotont_operations.network_check.findings import FAULT, GOOD, NOTE, Finding, not_checked
from robotont_operations.network_check.master import Master
from robotont_operations.network_check.other_nodes import check_nodes
from robotont_operations.network_check.time_budget import TimeBudget
from robotont_operations.network_check.way_back import FAREWELL, WAY_BACK, WayBack


class NetworkCheck:
    """The checks from this machine, in the order in which one fault hides the next."""

    def __init__(self, environment):
        self._environment = environment
        self._budget = TimeBudget()
        self._way_back = None
        self._beside = []  # (what is checked, its Future): beside the questions to the nodes, which may take long

    def run(self):
        """List of Findings; takes at most the budget."""
        master = Master(self._environment, self._budget)
        findings = [master.find()]
        if master.address is None:
            return findings
        master_is_here = probes.is_own(master.address)
        own = "127.0.0.1" if master_is_here else probes.own_address_towards(master.address)
        announced = announced_by(self._environment)
        if not master_is_here:
            self._way_back = WayBack(master, announced, own, self._budget)
            self._begin(WAY_BACK, self._way_back.check)
            self._begin_clock(master.address, master.port)
        nodes, missing = master.nodes()
        others, about_nodes = check_nodes(nodes, master.address, master_is_here, self._budget)
        findings += ([missing] if missing else []) + about_nodes
        findings.append(check_announced(announced, self._environment, own, master_is_here, others, self._budget))
        clocks = set() if master_is_here else {master.address}
        for node, address in others.items():
            if address not in clocks:
                clocks.add(address)
                self._begin_clock(address, node.port)
        for what, job in self._beside:
            finding = job.result() if wait([job], self._budget.left()).done else not_checked(what)
            findings += [finding] if finding else []
        if master_is_here and not others:
            findings.append(Finding(NOTE, "no node of another machine is registered here: run ./robotont network "
                                          "there, too"))
        return findings

    def cancel(self):
        """Let the way back end at once, and unregister itself."""
        if self._way_back:
            self._way_back.cancel()
        wait([job for _, job in self._beside], FAREWELL)

    def _begin(self, what, work, *arguments):
        self._beside.append((what, probes.start(work, *arguments)))

    def _begin_clock(self, address, port):
        self._begin(f"the clock of {address}", check_clock, address, port, self._budget)


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
    except KeyboardInterrupt:
        check.cancel()
        os._exit(130)
    colour = {GOOD: GREEN, NOTE: YELLOW, FAULT: RED}
    for level, words in findings:
        print(f"{paint(f'{level:5}', colour[level])}  {words}")
    sys.stdout.flush()
    os._exit(any(level == FAULT for level, _ in findings))  # resolvers that still wait must not hold this up
