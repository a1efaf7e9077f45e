"""The clock of another machine: whether it agrees with this one's."""

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, Finding

TOLERANCE = 0.2  # [s] between two clocks; tf's listeners wait about as long for a transform


def check_clock(report, address, port):
    """Report whether a machine's clock agrees; nothing where its server shows none."""
    measured = probes.clock_difference(address, port)
    if measured is None:
        return
    difference, uncertainty = measured
    if abs(difference) - uncertainty > TOLERANCE:
        report(Finding(FAULT, f"clocks apart: that of {address} is {abs(difference):.1f} s "
                              f"{'ahead of' if difference > 0 else 'behind'} this machine's: "
                              "sudo apt-get install chrony on both (without internet: docs/network.md)"))
    else:
        report(Finding(GOOD, f"the clock of {address} agrees within {max(0.01, abs(difference) + uncertainty):.2f} s"))
