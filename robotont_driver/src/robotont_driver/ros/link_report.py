"""What the diagnostics say of the line to the board, and of the board."""

import time

from robotont_driver.ros.diagnostics import ERROR, OK, WARN, Rate


class LinkReport:
    """Tasks for `Health`. link: `SerialLink`; protocol: the expected one; refusals: `Refusals` of serial_write."""

    def __init__(self, link, protocol, refusals, battery):
        self._link = link
        self._protocol = protocol
        self._refusals = refusals
        self._battery = battery
        self._rate = Rate()
        self._failures = 0        # of this program, already reported
        self._trouble_before = 0  # errors up to the last report

    def report_link(self):
        """Level, words and values of the line."""
        protocol, link = self._protocol.spoken, self._link
        read = protocol.packets - protocol.repaired
        rate = self._rate.look(read, time.monotonic())
        dropped = sum(protocol.dropped.values())
        errors = dropped + self._refusals.amount
        new_errors, self._trouble_before = max(0, errors - self._trouble_before), errors
        values = {
            "packets": protocol.description,
            "packets read per second": f"{rate:.1f}",
            "packets read": read,
            "packets published": protocol.packets,
            "packets written": link.writer.sent,
            "commands overtaken by newer ones": link.writer.outbox.replaced,
            "commands while the port was closed": link.unsent,
            "commands refused": self._refusals.amount,
            "commands too old": link.outdated,
            "times that this node was stopped or starved": link.stalls.stalls,
            "stops for lack of commands": link.timeouts,
            "lines dropped": dropped,
            **{"lines dropped: " + kind: count for kind, count in sorted(protocol.dropped.items())},
            "periods repaired": protocol.repaired,
            "board restarts": protocol.restarts,
            "lost lines that may have been a restart": protocol.doubts,
            "reconnects": max(0, link.opened - 1),
            "faults of this program": link.failures,
        }
        new_failures, self._failures = link.failures - self._failures, link.failures
        if new_failures:
            return ERROR, f"a fault of serial_com_node itself, {link.failure}; please report it, with its log", values
        if link.trouble:
            return ERROR, link.trouble, values
        if protocol.complaint:
            return WARN, protocol.complaint, values
        if rate == 0.0:
            return WARN, silence(protocol, new_errors), values
        if new_errors:
            return WARN, f"{new_errors} lines dropped in the last second: check cable and baudrate", values
        return OK, f"{rate:.0f} packets/s, {protocol.name}", values

    def report_board(self):
        """Level, words and values of what the board says of itself."""
        errors, warnings, values = self._protocol.spoken.report_board()
        empty, words = self._battery.complaint
        (errors if empty else warnings).extend([words] if words else [])
        if self._link.trouble:
            return WARN, "the port is closed", values
        level = ERROR if errors else WARN if warnings else OK
        return level, " / ".join(errors + warnings) or "reports no fault", values


def silence(protocol, dropped):
    """Message about a board that has sent no packet since the last report, but lines that were `dropped`."""
    if not dropped:
        return "port open, but no packets: is the firmware running, at this baudrate?"
    return (f"{dropped} lines came in the last second, and none is a packet of a board that speaks {protocol.name}: "
            f"{protocol.newest_error}; is it another board (~packets), another firmware, or another baudrate?")
