"""Interprets held keys of a terminal; free of ROS, terminal and clock.

A terminal sends a key when it goes down and again and again while it is held, but nothing when it goes up, and of
several held keys it repeats the last one only. So a movement lasts until keys stop coming: `first` [s] after a key
that has just gone down (longer than the keyboard's delay before it repeats), `repeat` [s] after one that repeats. Keys
of different axes add up: while any movement key is held, all that were set go on. The opposite key stops its axis
first, and reverses it at the next press or repeat.
"""

import re

from robotont_teleop.hand.speeds import STOP

MOVES = {  # key: (axis, sign)
    "w": (0, 1), "s": (0, -1), "a": (1, 1), "d": (1, -1), "q": (2, 1), "e": (2, -1),
    "up": (0, 1), "down": (0, -1), "left": (2, 1), "right": (2, -1),
}
SPEED_KEYS = {  # key: factors of the linear and the angular speed
    "+": (1.1, 1.1), "=": (1.1, 1.1), "-": (1 / 1.1, 1 / 1.1),
    "r": (1.1, 1.0), "f": (1 / 1.1, 1.0), "t": (1.0, 1.1), "g": (1.0, 1 / 1.1),
}
EMERGENCY_STOP, QUIT = " ", ("\x03", "\x04", "\x1b")
RELEASE = "\x15"  # Ctrl-U: no letter, which a slip or Caps Lock could make
# a sequence of ECMA-48 that a key sends, or a letter; no blank nor Ctrl-D: behind Alt-[ they are keys, that stop
KEY = re.compile(r"\x1b[\[O][^A-Za-z~\x00- ]*[A-Za-z~]?|.", re.DOTALL)
BEGUN = re.compile(r"\x1b[\[O][^A-Za-z~\x00- ]{0,13}\Z")
ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
MOST_AT_ONCE = 10    # keys; no keyboard makes more between two looks, so they have waited, as in a network that hung
REPEATS_WITHIN = 0.15  # [s] a key that comes again sooner is held, not pressed twice


class HeldKeys:
    """The movement that the keys ask for at a given time [s]."""

    def __init__(self, speeds, largest, first, repeat):
        self.speeds = speeds
        self._largest = largest
        self._first, self._repeat = first, repeat
        self._position = [0, 0, 0]
        self._last = None      # newest movement key
        self._pressed = None   # [s] when it came
        self._end = None       # [s] when the movement ends

    def press(self, key, now):
        """Take a key; whether it means anything."""
        if key in SPEED_KEYS:
            self.speeds = self.speeds.scaled(*SPEED_KEYS[key], self._largest)
            return True
        if key not in MOVES:
            return False
        self._expire(now)
        repeats = key == self._last and now - self._pressed < REPEATS_WITHIN
        axis, sign = MOVES[key]
        self._position[axis] = 0 if self._position[axis] == -sign else sign
        self._last, self._pressed = key, now
        self._end = now + (self._repeat if repeats else self._first)
        return True

    def release(self):
        """Forget all movement."""
        self._position = [0, 0, 0]
        self._last = self._end = None

    def twist(self, now):
        """(v_x [m/s], v_y [m/s], omega [rad/s])."""
        self._expire(now)
        return self.speeds.twist(*self._position) if any(self._position) else STOP

    def _expire(self, now):
        if self._end is not None and now >= self._end:
            self.release()


def keys_of_now(keys, settled):
    """Those that count; of some that may have waited only what stops. settled: whether this process was not held up.

    What ends the program comes last: a stop that came with it goes out.
    """
    waited = not settled or len(keys) > MOST_AT_ONCE
    return sorted((key for key in keys if not waited or key == EMERGENCY_STOP or key in QUIT), key=QUIT.__contains__)


def split_keys(text):
    """Names of the keys in a terminal's input, and the rest that may be the start of one more.

    Letters are small, whatever Caps Lock makes of them.
    """
    text = re.sub("[\0\xa0\udca0\u2000-\u200d\u202f\u3000]", EMERGENCY_STOP, text)  # with Ctrl, Alt Gr, Shift; wide
    begun = BEGUN.search(text)
    keys = [key.lower() if key[1:2] not in "[O" or len(key) == 1 else ARROWS.get(key[2:], "other")
            for key in KEY.findall(text[:begun.start()] if begun else text)]
    return keys, begun.group() if begun else ""
