"""Whether a command may have waited, in a kernel, an outage, a stopped process."""
# all that waited comes behind a gap: so what comes within the first SETTLING behind one does not drive

import math

SETTLING = 0.3   # [s]
SILENCE = 0.5    # [s] of a sender on another machine, behind which its commands may have waited
MOST_KNOWN = 64  # connections


class Gaps:
    """Finds gaps longer than `longest` [s] between calls, `since` [s] the one before the first; -inf: in a gap."""

    def __init__(self, longest, since):
        self._longest = longest
        self._newest = since
        self._settled = -math.inf
        self.amount = 0

    def tick(self, now):
        """Note a sign of life."""
        if now - self._newest > self._longest:
            self._settled = now + SETTLING
            self.amount += 1
        self._newest = max(self._newest, now)

    def settled(self, now):
        """Note a sign of life; whether nothing that comes now can have waited."""
        self.tick(now)
        return now >= self._settled


class Arrivals:
    """Judges the commands of some subscribers; not for two threads at once. Times [s] are those of `boot_time`.

    longest: [s] for which this process may be stopped or starved. is_local(header): whether the connection with this
    header comes from this machine, where nothing waits but in this process, whose own are `gaps`.
    """

    def __init__(self, longest, now, is_local):
        self.gaps = Gaps(longest, now)
        self._is_local = is_local
        self._known = {}  # (header, Gaps or None) of the newest connections, by the header's id

    def are_new(self, header, now):
        """Whether a command may drive that comes `now` by the connection with this header."""
        # the first one of a publisher that latches, or from another machine, is as old as it likes
        new = self.gaps.settled(now)
        if id(header) not in self._known:
            self._known = dict([*self._known.items()][1 - MOST_KNOWN:])
            self._known[id(header)] = header, None if self._is_local(header) else Gaps(SILENCE, -math.inf)
            new = new and header.get("latching") != "1"
        _, gaps = self._known[id(header)]
        return (gaps is None or gaps.settled(now)) and new
