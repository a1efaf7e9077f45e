"""Whether a gamepad is still there; free of ROS, device and clock.

A pad with a radio that is out of reach looks like one whose sticks are held still: the receiver stays plugged in, and
repeats nothing. So only what changes is known to be there, and not yet what was there at the start. Times [s] are the
caller's, from a clock that never goes back.
"""

import math


class StillPad:
    """longest: [s] without a change of any stick or button, after which the pad counts as gone."""

    def __init__(self, longest):
        self._longest = longest
        self._state, self._changed = None, -math.inf

    def hear(self, state, now):
        """Its state at a time, as anything that can be compared; whether it counts as there."""
        if state != self._state:
            self._changed = now if self._state else -math.inf
            self._state = state
        return now - self._changed < self._longest
