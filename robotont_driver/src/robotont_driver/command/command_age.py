"""How old a command may be that is handled now, whatever it waited in: a kernel, an outage, a stopped process."""

import math
from collections import deque

OLDEST = 0.5    # [s] up to which a command may drive; a shorter time-out only says how long its sender may be silent
BURST = 0.1     # [s] for which data that waited comes at most
SETTLING = 0.3  # [s] likewise, behind a silence of OLDEST
UNSEEN = 1.0    # [s] without a sign of a machine, and twice the time that it takes to answer: it is out of reach
UNKNOWN = 0.5   # [s] that a machine takes to answer, as long as it has not


class Link:
    """What one connection tells about the age of its messages; times [s] are the caller's, of a steady clock.

    Behind an outage TCP delivers what waited, in one burst and in order. So each message may have been sent right
    behind the newest that came at least a burst earlier. Within a machine nothing waits.
    """

    def __init__(self, since):
        """since: when there was no data of this connection yet."""
        self.local = False
        self._heard = deque([since])  # the messages of the last BURST, and the one before them
        self._settled = since
        self._first = True

    def age(self, now, latching=False):
        """[s] that a message which comes `now` may have waited at most; math.inf: nobody knows.

        The first one of a publisher that latches is as old as it likes.
        """
        heard, latched, self._first = self._heard, latching and self._first, False
        if now - heard[-1] >= OLDEST:
            self._settled = now + SETTLING
        heard.append(now)
        while len(heard) > 1 and heard[1] <= now - BURST:
            heard.popleft()
        if latched or (now < self._settled and not self.local):
            return math.inf
        return 0.0 if self.local else now - heard[0]


class Reach:
    """Whether a machine is within reach; times [s] are the caller's, of a steady clock."""

    def __init__(self, now):
        self.lost = False
        self._seen = now     # within reach, as far as is known
        self._takes = None   # [s] to answer, the least of late

    def heard(self, now):
        """Data has come from it."""
        self._seen = now

    def answered(self, asked, now):
        """It has answered `now` what it was `asked` then."""
        self._takes = now - asked if self._takes is None else min(now - asked, 1.1 * self._takes)
        self._seen = max(self._seen, asked)

    def turns(self, now):
        """Look whether it is `lost`; returns whether this has changed."""
        takes = UNKNOWN if self._takes is None else self._takes
        before, self.lost = self.lost, now - self._seen > UNSEEN + 2 * takes
        return before != self.lost


class Arrivals:
    """The age of each command of some subscribers; not for two threads at once. Times [s] are those of `boot_time`.

    gap: [s] for which this process may be stopped or starved before that counts, as in `StallWatch`.
    """

    def __init__(self, gap, now):
        self.stalls = StallWatch(gap, now)
        self.link = lambda header: None  # gives the Link of a connection by its header, or None: `OutageWatch.link`
        self._newest = None, None        # (header, Link) of the newest command

    def spent(self, header, now, timeout):
        """[s] of its time-out that a command may have used up which comes `now` by the connection with this header.

        From `timeout` on it does not drive.
        """
        known, link = self._newest
        if header is not known or link is None:
            link = self.link(header)
            self._newest = header, link
        waited = link.age(now, header.get("latching") == "1") if link else math.inf
        return max(waited - max(0.0, OLDEST - timeout), now - self.stalls.earliest_arrival(now))


LONGEST = 1.0  # [s] for which messages count as old after a gap, however long that was


class StallWatch:
    """Finds gaps longer than `gap` [s] between calls. Times [s] are the caller's, from a clock that never goes back.

    A busy computer may let the process wait again before it has emptied its queues. So messages count as old, as of the
    beginning of a gap, for as long after it as it lasted, at least for `gap`, which is the shortest that is noticed,
    and for LONGEST at most; a gap that begins meanwhile continues the first.
    """

    def __init__(self, gap, now):
        self._gap = gap
        self._ticked = now
        self._began = None         # the newest gap
        self._settled = -math.inf  # from when on messages are new again
        self.stalls = 0

    def tick(self, now):
        """Note that the process is alive; call it much more often than every `gap`."""
        waited = now - self._ticked
        if waited > self._gap:
            if self._ticked >= self._settled:
                self._began = self._ticked
            self._settled = now + min(max(self._gap, waited), LONGEST)
            self.stalls += 1
        self._ticked = max(self._ticked, now)  # a thread may have read the clock before the gap

    def earliest_arrival(self, now):
        """[s] when a message that is handled `now` may have arrived at the earliest."""
        self.tick(now)
        return self._began if now < self._settled else now
