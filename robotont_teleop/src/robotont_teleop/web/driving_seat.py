"""Which of the open pages drives, and which of its commands may go out; free of network, ROS and clock.

Times [s] are the server's, from a clock that never goes back. A page cannot be believed about time: its clock may be
wrong and its messages late. So each command carries the newest server time that its page had seen, and the command's
age is the time since then: the way to the page, the page's own delay, and the way back.
"""

from robotont_teleop.hand.speeds import STOP

CLOCK_RESOLUTION = 0.001  # [s] of the times in messages


class DrivingSeat:
    """One page drives, any number of pages watch."""

    def __init__(self, speeds, oldest, dead_man):
        self.speeds = speeds      # Speeds that no command exceeds
        self._oldest = oldest      # [s] an older command is dropped; a zero still stops
        self._dead_man = dead_man  # [s] after the server time that its newest command has seen the robot stops
        self.driver = None         # the page that drives
        self._moving_since = None  # [s] server time that the newest command with motion has seen, None when at rest
        self.held = set()          # pages whose sticks must be let go before they drive

    def is_fresh(self, seen, now):
        """Whether a message of a page that had seen server time `seen` is new enough."""
        return -CLOCK_RESOLUTION <= now - seen <= self._oldest

    def take(self, page):
        """Let a page drive; the twist to send, or None. The page before has lost the robot, wherever its sticks are.

        A stick that the new driver already holds moves nothing until it has been let go of.
        """
        if page == self.driver:
            return None
        self.driver = page
        return self._rest()

    def leave(self, page):
        """A page is gone; the twist to send, or None."""
        self.held.discard(page)
        if page != self.driver:
            return None
        self.driver = None
        return self._rest()

    def command(self, page, seen, twist, now, stopped=False):
        """Take a command of a page that had seen server time `seen`; the twist to send, or None.

        A free seat is taken by the first page that asks for motion, unless it has done so while another one drove.
        `stopped`: the emergency stop is pressed; whoever holds a stick then has to let go of it first.
        """
        if not self.is_fresh(seen, now):
            return self._rest() if page == self.driver and twist == STOP else None  # to stand is never too late
        if twist == STOP:
            self.held.discard(page)
            if page != self.driver:
                return None
            self._moving_since = None
            return STOP
        if self.driver is None and page not in self.held:
            self.driver = page
        if stopped or page != self.driver:
            self.held.add(page)
        if page != self.driver:
            return None
        if page in self.held:
            return self._rest()
        self._moving_since = seen  # not when it came: a stall of either way counts from its first moment
        return self.speeds.within(twist)

    def stop(self):
        """An emergency stop; the twist to send, or None. The sticks have to be let go of first."""
        if self.driver is not None:
            self.held.add(self.driver)
        return self._rest()

    def look(self, now):
        """STOP when the driver has fallen silent while moving, else None."""
        if self._moving_since is None or now - self._moving_since < self._dead_man:
            return None
        self.held.add(self.driver)
        return self._rest()

    def time_left(self, now):
        """[s] until the dead-man's time is over; None at rest."""
        return None if self._moving_since is None else max(0.0, self._moving_since + self._dead_man - now)

    def _rest(self):
        if self._moving_since is None:
            return None
        self._moving_since = None
        return STOP
