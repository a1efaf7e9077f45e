"""What the diagnostics say of the line to the board, and of the board."""

import time

import rospy

from robotont_driver.protocol.connection import LISTENING
from robotont_driver.ros.diagnostics import ERROR, FIRST_RATE, OK, WARN, Rate

RESTARTED = "the board has restarted, or too many lines were lost: the counts between are missing in the odometry"
DOUBT = "lines of the board were lost, or it has restarted: the odometry may be wrong by the counts between"
NONE = 0, 0, 0, 0, 0
LOST = 0.1  # part of the periods whose lines may be lost without a warning


class LinkReport:
    """Tasks for `Health`. link: `SerialLink`; written: the topic serial_write; battery: `Battery`."""

    def __init__(self, link, written, battery):
        self._link, self._written, self._battery = link, written, battery
        self._connection, self._rate = None, Rate(0.0)
        self._seen = NONE  # lines dropped, packets, repaired ones, restarts and doubts up to the last report
        self._told = 0     # messages refused, likewise
        self._fault = ""   # what the board has said of itself

    def report_link(self):
        """Level, words and values of the line."""
        link, connection, now = self._link, self._link.connection, time.monotonic()
        if connection is not self._connection:
            self._connection, self._rate, self._seen = connection, Rate(connection.opened), NONE
        protocol = connection and connection.protocol
        refused, dropped = self._written.refused, dict(protocol.dropped) if protocol else {}
        packets, repaired, restarts, doubts = (
            protocol.packets, protocol.repaired, protocol.restarts, protocol.doubts) if protocol else NONE[1:]
        rate = self._rate.look(packets - repaired, now)
        values = {
            "connection": connection.state(now) if connection else "closed",
            "packets": protocol.name if protocol else "not known yet",
            "packets read per second": f"{rate:.1f}",
            "packets read": packets - repaired,
            "packets published": packets,
            "packets written": link.sent,
            "commands while the port was closed": link.unsent,
            "commands refused": refused,
            "commands too old": link.outdated,
            "times that this node was stopped or starved": link.gaps.amount,
            "stops for lack of commands": link.timeouts,
            "lines dropped": sum(dropped.values()),
            **{"lines dropped: " + kind: count for kind, count in sorted(dropped.items())},
            "periods repaired": repaired,
            "board restarts": restarts,
            "lost lines that may have been a restart": doubts,
            "reconnects": max(0, link.opened - 1),
        }
        seen = values["lines dropped"], packets, repaired, restarts, doubts
        new_errors, new_packets, lost, restarted, doubted = (new - before for new, before in zip(seen, self._seen))
        if packets:  # a connection may begin within a line: what was dropped before its first packet is no fault
            new_errors = min(new_errors, values["lines dropped"] - protocol.dropped_before)
        no_packets, self._seen, self._told = refused - self._told, seen, refused
        if restarted:
            rospy.logwarn(RESTARTED)
        if doubted:
            rospy.logwarn_throttle(10.0, DOUBT)
        if link.trouble:
            return ERROR, link.trouble, values
        if not packets and not connection.obstacle and now < connection.opened + FIRST_RATE:
            return OK, "just opened", values
        warning = connection.obstacle or connection.complaint
        if warning:
            pass
        elif rate == 0.0 and new_errors:
            warning = (f"{new_errors} lines came since the last report, and none is a packet of a board that speaks "
                       f"{protocol.name}: {protocol.newest_error}; is it another board (~packets), another firmware, "
                       "or another baudrate?")
        elif rate == 0.0:
            warning = "port open, but no packets: is the firmware running, at this baudrate?"
        elif lost > LOST * new_packets:
            warning = f"{lost / new_packets:.0%} of the board's lines are lost or never sent: check cable and baudrate"
        elif new_errors:
            warning = (f"{new_errors} lines dropped since the last report, the newest: {protocol.newest_error}; check "
                       "cable and baudrate")
        elif no_packets:
            warning = f"{no_packets} messages on serial_write were no packets"
        return (WARN, warning, values) if warning else (OK, f"{rate:.0f} packets/s, {protocol.name}", values)

    def report_board(self):
        """Level, words and values of what the board says of itself."""
        connection = self._link.connection
        errors, warnings, values = [], [], {}
        if connection and connection.protocol:
            errors, warnings, values = connection.protocol.report_board()
            before, self._fault = self._fault, " / ".join(one for one in errors if one != connection.obstacle)
            if self._fault and not before:
                rospy.logerr("the board: %s", self._fault)
        if self._link.trouble:
            return WARN, "the port is closed", values
        if connection.obstacle and connection.obstacle not in errors:
            errors.insert(0, connection.obstacle)
        empty, words = self._battery.complaint
        (errors if empty else warnings).extend([words] if words else [])
        level = ERROR if errors else WARN if warnings else OK
        return level, " / ".join(errors + warnings) or (
            "has sent no packet yet" if connection.state(time.monotonic()) == LISTENING else "reports no fault"), values
