"""Whether the robot moves as it is commanded: what it does not see it feels by its wheels. Without ROS."""

import math

HELD = 1.0         # [s] without the motion that is commanded, after which something holds the robot
LEAST = 0.04       # [m/s] of the outermost wheel; slower commands prove nothing
MOVES = 1.0 / 3.0  # of the commanded motion at least; the motors' lag is over within a part of HELD
SILENCE = 0.3      # [s] without a measured twist or a command, and nothing is known


class HoldWatch:
    """Compares what is commanded with what the wheels measure.

    radius: [m] from the middle to the wheels. Twists are (v_x [m/s], v_y [m/s], omega [rad/s]); times `now` [s].
    """

    def __init__(self, radius):
        self._radius = radius
        self._commanded, self._commanded_at = (0.0, 0.0, 0.0), -math.inf
        self._measured_at = -math.inf
        self._since = None  # [s] since when the robot does not move as commanded

    def command(self, twist, now):
        """What goes out to the wheels for navigation; (0, 0, 0) where something else drives."""
        self._commanded, self._commanded_at = twist, now

    def measure(self, twist, now):
        """A twist of the odometry; returns words when something holds the robot, else an empty string."""
        if now - self._measured_at > SILENCE or now - self._commanded_at > SILENCE:
            self._since = None
        self._measured_at = now
        commanded = self._speeds(self._commanded)
        asked = math.hypot(*commanded)
        moved = sum(a * b for a, b in zip(commanded, self._speeds(twist))) / asked if asked >= LEAST else math.inf
        if moved >= MOVES * asked:
            self._since = None
            return ""
        if self._since is None:
            self._since = now
        if now - self._since < HELD:
            return ""
        return (f"something holds the robot: for {HELD:g} s it was to move at {asked:.2f} m/s, and its wheels moved "
                f"it at {moved:.2f} m/s; look before it and at its wheels")

    def _speeds(self, twist):
        """(v_x, v_y, speed of the wheels by the turn) [m/s]."""
        return twist[0], twist[1], self._radius * twist[2]
