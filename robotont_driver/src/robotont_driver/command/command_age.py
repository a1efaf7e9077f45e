"""How old a command may be that is handled now, whatever it waited in: a kernel, an outage, a stopped process."""

import math
from collections import deque

from robotont_driver.timing.starvation import StallWatch

OLDEST = 0.5  # [s] up to which a command may drive; a shorter time-out only says how long its sender may be silent
UNSEEN = 1.0  # [s] without data and without a look at the publisher's machine, after which its data may be of any age
PAUSE = 2.0   # [s] behind a longer silence nothing waited at the last look
BURST = 0.1   # [s] for which data that waited comes at most


class Link:
    """What one connection tells about the age of its messages; times [s] are the caller's, of a steady clock.

    Behind an outage TCP delivers what waited in the sender's kernel, maybe seconds after the network is back, and also
    when the sender has ended. So only looks without a gap, from the last message to the next, prove that nothing
    waited. A link that misses one is `lost`, for good: another connection has to take its place. Outages between two
    looks look like a pause; one of TCP is no longer than PAUSE. What waited comes in one burst behind it, in order; so
    each message may have been sent right behind the newest that came at least a burst earlier. A machine is always
    within reach of itself.
    """

    def __init__(self, since):
        """since: when there was no data of this connection yet."""
        self.local = False
        self.lost = False
        self._heard = deque([since])  # the messages of the last BURST, and the one before them
        self._reached = since
        self._first = True

    def age(self, now, latching=False):
        """[s] that a message which comes `now` may have waited at most; math.inf: nobody knows.

        The first one of a publisher that latches is as old as it likes.
        """
        first, self._first = self._first, False
        if first and latching:
            return math.inf
        if self.local:
            return 0.0
        self._miss(now)
        heard = self._heard
        if now - heard[-1] >= PAUSE:
            heard.append(self._reached)
            while len(heard) > 1:
                heard.popleft()  # never empty: another thread looks at the newest
        heard.append(now)
        while len(heard) > 1 and heard[1] <= now - BURST:
            heard.popleft()
        return math.inf if self.lost else now - heard[0]

    def reached(self, since):
        """The machine was within reach some time after `since`."""
        self._miss(since)
        self._reached = max(self._reached, since)

    def _miss(self, now):
        if now - max(self._heard[-1], self._reached) > UNSEEN:
            self.lost = True


class Arrivals:
    """The age of each command of some subscribers; not for two threads at once. Times [s] are those of `boot_time`.

    gap: [s] for which this process may be stopped or starved before that counts, as in `StallWatch`.
    """

    def __init__(self, gap, now):
        self.stalls = StallWatch(gap, now)
        self.link = lambda header: None  # gives the Link of a connection by its header, or None: `OutageWatch.link`

    def spent(self, header, now, timeout):
        """[s] of its time-out that a command may have used up which comes `now` by the connection with this header.

        From `timeout` on it does not drive.
        """
        link = self.link(header)
        waited = link.age(now, header.get("latching") == "1") if link else math.inf
        return max(waited - max(0.0, OLDEST - timeout), now - self.stalls.earliest_arrival(now))
