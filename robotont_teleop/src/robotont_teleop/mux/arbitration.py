"""Which of several senders of commands drives the robot; free of ROS and clock.

A twist is (v_x [m/s], v_y [m/s], omega [rad/s]). Times [s] are the caller's, from any clock that never goes back.
"""

import math
from typing import NamedTuple

from robotont_driver.command.emergency_stop import StandFirst
from robotont_teleop.hand.speeds import STOP

NOBODY, EMERGENCY_STOP = "nobody", "emergency stop"
LOCK_PERIOD = 0.2  # [s] between two zeros during an emergency stop, for receivers that start meanwhile


class Input(NamedTuple):
    """A topic of commands, for one or several senders."""

    name: str
    timeout: float  # [s] silence after which the robot stops
    rest: float     # [s] after its last motion during which no input below it drives
    zeros_of_all: bool = False  # whether a zero stops, also of a sender that does not drive


class _State:
    """State of an input."""

    def __init__(self, settings, held, now):
        self.name, self.timeout, self.zeros_of_all = settings.name, settings.timeout, settings.zeros_of_all
        self.hold = max(settings.rest, settings.timeout)  # [s] how long one motion claims the robot
        self.twist = STOP
        self.received = None  # [s] time of the newest command
        self.moved = None     # [s] time of the newest command with motion; None = no claim
        self.stand_first = StandFirst(settings.timeout, held, now)
        self.sender = None    # the one whose motion this is
        self.ignored = None   # (sender, [s]) of the newest motion that another sender has asked for meanwhile
        self.stands_until = -math.inf  # [s] until when whatever it asks for is a zero

    def lock(self, now):
        """An emergency stop begins: nobody claims the robot."""
        self.stand_first.press(now)
        self.moved = None

    def release(self, now):
        """It ends, and nothing moves by it."""
        self.stand_first.release(now)
        self.twist = STOP

    def moving(self, now):
        """Whether it asks for motion now."""
        return self.twist != STOP and self.received is not None and now - self.received < self.timeout

    def admits(self, sender, twist, now):
        """Whether a sender's command counts, and is not one beside the commands of the sender that drives."""
        if sender != self.sender and self.moving(now):
            if twist == STOP:
                return self.zeros_of_all
            self.ignored = sender, now
            return False
        self.sender = sender
        return True

    def claims(self, now):
        """Whether it may drive now, or rests with the robot still its own."""
        return self.moved is not None and now - self.moved < self.hold


class Arbiter:
    """The highest input that moves drives; each method returns the twists to send, in this order.

    Of the senders of one input the first that asks for motion has it until it stops or falls silent; the motion
    that others ask for is ignored meanwhile, and their zeros unless the input has `zeros_of_all`. An input takes
    the robot with its first command other than zero, and keeps it until its `rest` has passed since its last
    motion. Zeros of an input that does not drive are ignored, so that an idle sender blocks no other. An emergency
    stop takes the robot from all of them; each sender that has asked for motion and not stopped when it is released
    has to stop first, by a zero of its own or by silence: releasing never moves the robot. held, now: as of
    `StandFirst`.
    """

    def __init__(self, inputs, held=(), now=0.0):
        self._states = [_State(settings, held, now) for settings in inputs]  # highest first
        self._by_name = {state.name: state for state in self._states}
        self._driver = None
        self.sent = STOP  # the newest twist
        self._lock_sent = 0.0
        self.locked = False
        self.timeouts = 0  # times that a moving robot was stopped because its driver fell silent

    @property
    def driver(self):
        """Name of the input that drives, NOBODY or EMERGENCY_STOP."""
        if self.locked:
            return EMERGENCY_STOP
        return self._driver.name if self._driver else NOBODY

    def barred(self, now):
        """Names of the inputs that have to stop once before they drive."""
        return [state.name for state in self._states if state.stand_first.waiting(now)]

    def held(self, now):
        """Names of the senders that have to stop once before they drive."""
        return sorted({sender for state in self._states for sender in state.stand_first.waiting(now)})

    def ignored(self, now):
        """List of (input, sender, sender that has the input) where somebody asks in vain for motion."""
        return [(state.name, state.ignored[0], state.sender) for state in self._states
                if state.ignored and now - state.ignored[1] < state.timeout and state.moving(now)]

    def command(self, name, twist, now, sender=""):
        """Take a command that a sender has put on an input; the time-outs that were due before it come first."""
        due = self.look(now)
        state = self._by_name[name]
        if not state.stand_first.admits(sender, twist != STOP, now) or not state.admits(sender, twist, now):
            return due
        state.twist, state.received = STOP if now < state.stands_until else tuple(twist), now
        if self.locked:
            return due
        if twist != STOP:
            state.moved = now
        due += self._choose(now)
        if state is self._driver:
            due.append(state.twist)
            self.sent = state.twist
        return due

    def emergency_stop(self, pressed, now):
        """Lock while pressed."""
        pressed = bool(pressed)
        if pressed == self.locked:
            return []
        self.locked = pressed
        for state in self._states:
            (state.lock if pressed else state.release)(now)
        self._driver = None
        return self._stop_lock(now) if pressed else []

    def stand(self, name, seconds, now):
        """What an input asks for is a zero from now on, for so long; it keeps the robot if it drives."""
        state = self._by_name[name]
        state.stands_until, state.twist = max(state.stands_until, now + seconds), STOP  # of several the longest
        return self._stop() if state is self._driver else []

    def give_back(self, now):
        """On request: the driver's rest ends now, and inputs that had to stop first may drive at their next command."""
        if self._driver:
            self._driver.moved = None
        for state in self._states:
            state.stand_first.excuse()
        return self._choose(now)

    def look(self, now):
        """The actions that have become due by the passage of time."""
        if self.locked:
            return self._stop_lock(now) if now - self._lock_sent >= LOCK_PERIOD else []
        driver = self._driver
        due = []
        if driver and self.sent != STOP and now - driver.received >= driver.timeout:
            self.timeouts += 1
            due = self._stop()
        return due + self._choose(now)

    def time_left(self, now):
        """[s] until `look` may have something to do; None when only a message can change anything."""
        if self.locked:
            return max(0.0, self._lock_sent + LOCK_PERIOD - now)
        if not self._driver:
            return None
        ends = [self._driver.moved + self._driver.hold]
        if self.sent != STOP:
            ends.append(self._driver.received + self._driver.timeout)
        return max(0.0, min(ends) - now)

    def _choose(self, now):
        """Give the robot to the highest input that claims it; a zero lies between two drivers."""
        driver = next((state for state in self._states if state.claims(now)), None)
        if driver is self._driver:
            return []
        self._driver = driver
        return self._stop()

    def _stop(self):
        if self.sent == STOP:
            return []
        self.sent = STOP
        return [STOP]

    def _stop_lock(self, now):
        self.sent, self._lock_sent = STOP, now
        return [STOP]
