"""When a robot that is commanded to move stands still, and a command of zeros may free it; without ROS.

A board switches all motors off when a wheel is blocked, as at a wall, until a command of zeros (docs/firmware.md).
move_base sends none for many seconds, and RotateRecovery none ever: it turns until the robot has turned.
"""

PATIENCE = 1.5  # [s] of commands without motion until zeros are sent; a board takes 0.5 s to notice, and 0.5 s more
TRIES = 10      # without motion in between; then it is no wall, and the board's caution counts
PAUSE = 0.5     # [s] without a command, after which the next one is the first
SLOW, SLOW_TURN = 0.02, 0.1  # [m/s], [rad/s] up to which a robot stands


class Blockage:
    """Told all commands and all measured twists; times in [s]."""

    def __init__(self):
        self._since = None   # when the commands began that have moved nothing
        self._newest = None  # when the newest command came
        self.tries = 0       # since the last motion

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
        self.tries += 1
        return True

    def measure(self, speed, turn):
        """Take a measured speed [m/s] and turn [rad/s]."""
        if speed > SLOW or abs(turn) > SLOW_TURN:
            self._since = None
            self.tries = 0
