"""The motion to carry out, given what was commanded and when: time-outs, stops and limits."""

from robotont_driver.command.emergency_stop import StandFirst
from robotont_driver.command.limits import limit_acceleration, limit_bend, limit_speed

STOP = (0.0, 0.0, 0.0)
LARGEST = 1000.0  # [m/s, rad/s] beyond any robot; a larger number is a fault of the sender


class CommandStream:
    """Turns commanded twists (v_x, v_y, omega) into the one that may go out at a time [s]. held, now: `StandFirst`."""

    def __init__(self, kinematics, limits, timeout, period, held=(), now=0.0):
        self.kinematics = kinematics
        self.limits = self._given = limits
        self.timeout = timeout    # [s] a command older than this stops the robot
        self.period = period      # [s] the longest time that one step of acceleration may count
        self.stopped = False      # emergency stop
        self.commands = 0
        self.refused = 0
        self.timeouts = 0
        self.limited = False      # whether the newest command was shortened: too fast, or too sharp a bend
        self.cut_off = False      # whether the newest time-out stopped a moving robot
        self._stand_first = StandFirst(timeout, held, now)
        self._refusal = None      # why the newest command was refused
        self._target = None       # newest valid command within the limits; None = stop at once
        self._received = None     # [s] when it came
        self._before = STOP       # newest valid command
        self._sent = STOP
        self._sent_at = 0.0

    def command(self, linear, angular, received, sender=""):
        """Take a Twist's vectors, (x, y, z) [m/s] and [rad/s]; None, or why it is refused: the robot stops then."""
        self.commands += 1
        self._refusal = refuse(linear, angular)
        if self._refusal:
            self.refused += 1
            self._target = None
            return self._refusal
        wanted = (linear[0], linear[1], angular[2])
        if not self._stand_first.admits(sender, wanted != STOP, received):
            return None
        slower = limit_speed(wanted, self.kinematics.wheel_speeds(wanted), self.limits)
        since = 0.0 if self._received is None else received - self._received
        self._target = limit_bend(slower, self._before, since, self.limits)
        self._before = wanted
        self.limited = self._target != wanted
        self._received = received
        self.cut_off = False
        return None

    def emergency_stop(self, pressed, now):
        """Stop while pressed; after it `StandFirst` tells who moves the robot. Returns whether this is a change."""
        changed = bool(pressed) != self.stopped
        if changed:
            self.stopped, self._target, self.cut_off = bool(pressed), None, False  # what happened before is over
            (self._stand_first.press if pressed else self._stand_first.release)(now)
        return changed

    def end(self):
        """Stand: the node ends. That is no emergency stop, behind which senders would have to stop first."""
        self.stopped, self._target = True, None

    def limit_wheels(self, fastest):
        """The board cannot turn a wheel faster than this [m/s]; 0: as fast as the limits allow."""
        speeds = [speed for speed in (self._given.wheel_speed, fastest) if speed > 0.0]
        self.limits = self._given._replace(wheel_speed=min(speeds, default=0.0))

    def twist(self, now):
        """The twist to send at time `now`. Stops (zeros, time-out, refusal, emergency) are not slowed by limits."""
        if self._target is not None and now - self._received >= self.timeout:
            self.timeouts += 1
            self.cut_off = self._target != STOP
            self._target = None
        if self.stopped or self._target in (None, STOP):
            self._sent = STOP
        else:
            elapsed = min(now - self._sent_at, self.period)
            self._sent = limit_acceleration(self._sent, self._target, elapsed, self.limits)
        self._sent_at = now
        return self._sent

    @property
    def ramping(self):
        """Whether the robot is on its way to the newest command."""
        return self._target is not None and self._sent != self._target

    def time_left(self, now):
        """[s] until the newest command times out, or None without a valid command."""
        return None if self._target is None else max(0.0, self._received + self.timeout - now)

    def age(self, now):
        """[s] since the newest valid command, or None before the first."""
        return None if self._received is None else now - self._received

    def waiting(self, now):
        """Names of the senders that ask for motion, but have to stop first."""
        return self._stand_first.waiting(now)

    def complaint(self, now):
        """Why the robot does not follow commands; empty when it does."""
        if self.stopped:
            return ("emergency stop: a person releases it, on the page, by the keys or by ./robotont release, the "
                    "class's on the class's page")
        waiting = self.waiting(now)
        if waiting:
            return f"{', '.join(waiting)} must stop once after the emergency stop before driving"
        if self._refusal:
            return "newest cmd_vel refused, robot stopped: " + self._refusal
        if self.cut_off:
            return "commands ended while the robot was driving, robot stopped: is their sender alive?"
        return ""


def refuse(linear, angular):
    """Why a robot on omni wheels cannot do this motion, two vectors (x, y, z) in base_link; None when it can."""
    (x, y, z), (roll, pitch, yaw) = linear, angular
    if abs(x) <= LARGEST and abs(y) <= LARGEST and abs(yaw) <= LARGEST and z == roll == pitch == 0.0:
        return None
    names = ("linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z")
    for name, value in zip(names, (*linear, *angular)):
        if not abs(value) <= LARGEST:  # or no number
            return f"{name} is {value:g}; allowed: a finite number up to {LARGEST:g}"
    name, value = next(pair for pair in (("linear.z", z), ("angular.x", roll), ("angular.y", pitch)) if pair[1])
    return f"{name} is {value:g}; a robot on the floor moves only by linear.x, linear.y and angular.z"
