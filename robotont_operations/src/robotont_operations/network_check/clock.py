"""The clock of another machine: whether it agrees with this one's."""

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, Finding, not_checked

TOLERANCE = 0.2  # [s] between two clocks; tf's listeners wait about as long for a transform


def check_clock(address, port, budget):
    """Finding about a machine's clock; None where its server shows none."""
    duration = min(1.1, budget.left() - 0.2)
    if duration < 0.1:
        return not_checked(f"the clock of {address}")
    measured = probes.clock_difference(address, port, duration)
    if measured is None:
        return None
    difference, uncertainty = measured
    if abs(difference) - uncertainty > TOLERANCE:
        return Finding(FAULT, f"clocks apart: that of {address} is {abs(difference):.1f} s "
                              f"{'ahead of' if difference > 0 else 'behind'} this machine's: "
                              "sudo apt-get install chrony on both (without internet: docs/network.md)")
    return Finding(GOOD, f"the clock of {address} agrees within {max(0.01, abs(difference) + uncertainty):.2f} s")
