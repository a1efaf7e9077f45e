"""Whether the robot moves as it is commanded: what it does not see it feels by its wheels. Without ROS."""

import math
from collections import deque

import numpy as np

LAG = 0.08      # [s] from a command until the wheels of every robot folder, also with 8 kg, move at MOVES of it
FELT = 0.14     # [s] without the motion that is commanded, after which something may hold the robot: it stands ...
STAND = 0.5     # [s] ... for so long, and tries again; a stalled computer looks the same, once
TRIES = 3       # such stands without FREE between them, and something holds the robot
FREE = 0.05     # [m] of the outermost wheel, driven as commanded, after which the stands before do not count
LEAST = 0.04    # [m/s] of the outermost wheel; slower commands prove nothing
MOVES = 1 / 3   # of the commanded motion at least
SILENCE = 0.5   # [s] without a measured twist or a command, and nothing is known
MOST_COMMANDS = 1000  # that are kept where no twist comes


class HoldWatch:
    """Compares what is commanded with what the wheels measure.

    radius: [m] from the middle to the wheels. Twists are (v_x [m/s], v_y [m/s], omega [rad/s]). Times [s]: `now`, of
    this computer; `stamp`, when a twist was measured, on the same clock.
    """

    def __init__(self, radius):
        self._weights = 1.0, 1.0, radius  # [1, 1, m]: a turn counts by the speed of the wheels
        self._commands = deque([(-math.inf, np.zeros(3))], MOST_COMMANDS)  # (time, speeds [m/s]), the newest last
        self._measured = -math.inf, -math.inf  # (stamp, time of arrival) of the newest twist
        self._since = None                  # as above, since when the robot does not move as commanded
        self._stands_until = -math.inf
        self._tries, self._way = 0, 0.0     # stands, and [m] driven as commanded since

    def command(self, twist, now):
        """What goes out to the wheels for navigation; (0, 0, 0) where something else drives."""
        self._commands.append((now, np.multiply(twist, self._weights)))

    def measure(self, twist, stamp, now):
        """(whether to stand for STAND, why the motion ends or "") by a twist, the mean since the stamp before."""
        before, self._measured = self._measured, (stamp, now)
        step = stamp - before[0]
        known = 0.0 < step < SILENCE and now - before[1] < SILENCE
        if not known or now - self._commands[-1][0] > SILENCE or now < self._stands_until:
            self._since = None
            return False, ""
        newest = self._commands[-1][1]
        while len(self._commands) > 1 and self._commands[1][0] <= before[0] - LAG:
            self._commands.popleft()  # the first one left is that which counted then
        length = math.hypot(*newest) or 1.0  # [m/s]; a command of nothing asks for nothing
        asked = min(np.dot(speeds, newest) for _, speeds in self._commands) / length
        moved = np.dot(np.multiply(twist, self._weights), newest) / length
        if asked < LEAST or moved >= MOVES * asked:
            self._since = None
            self._way += max(0.0, moved) * step
            if self._way > FREE:
                self._tries = 0
            return False, ""
        self._since = self._since or (before[0], now)  # the stamp's whole step was without motion; its news is new
        if min(stamp - self._since[0], now - self._since[1]) < FELT:
            return False, ""
        self._since, self._stands_until = None, now + STAND
        self._tries, self._way = self._tries % TRIES + 1, 0.0
        words = (f"something holds the robot: {TRIES} times it was to move at {length:.2f} m/s, and its wheels moved "
                 f"it at {moved:.2f} m/s; look before it and at its wheels")
        return True, (words if self._tries == TRIES else "")
