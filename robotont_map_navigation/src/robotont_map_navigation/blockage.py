"""When a robot that is commanded to move stands still, and a command of zeros may free it; without ROS.

A board switches all motors off when a wheel is blocked, as at a wall, until a command of zeros (docs/firmware.md).
move_base sends none for many seconds. But the board cannot distinguish a blocked wheel from an unplugged encoder, so
its caution counts after a few tries at one place.
"""

import math

PATIENCE = 1.5  # [s] of commands without motion until zeros are sent; a board takes 0.5 s to notice, and 0.5 s more
TRIES = 4       # until the robot has got AWAY; each may move a robot with a broken encoder for half a second
AWAY = 1.0      # [m] from where the first zeros were sent
PAUSE = 0.5     # [s] without a command, after which the next one is the first
SLOW, SLOW_TURN = 0.02, 0.1  # [m/s], [rad/s] up to which a robot stands


class Blockage:
    """Told all commands and all measured places and twists; times in [s]."""

    def __init__(self):
        self._since = None   # when the commands began that have moved nothing
        self._newest = None  # when the newest command came
        self._place = None   # (x, y) [m] by the odometry
        self._blocked_at = None  # the place of the first of the tries
        self.tries = 0

    def is_zero_due(self, moves, now):
        """Whether zeros have to be sent after a command that demands motion, or (not `moves`) is one of zeros."""
        if not moves:
            self._since = None
            return False
        if self._since is None or now - self._newest > PAUSE:
            self._since = now
        self._newest = now
        if now - self._since < PATIENCE or self.tries >= TRIES:
            return False
        self._since = None
        if not self.tries:
            self._blocked_at = self._place
        self.tries += 1
        return True

    def measure(self, place, speed, turn):
        """Take a measured place (x, y) [m], speed [m/s] and turn [rad/s]."""
        self._place = place
        if speed > SLOW or abs(turn) > SLOW_TURN:
            self._since = None
        if self.tries and math.dist(place, self._blocked_at or place) > AWAY:
            self.tries = 0
