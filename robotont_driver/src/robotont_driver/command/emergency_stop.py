"""The emergency stop: who presses it, what releases it, and who may drive after it; free of ROS and clock.

The rule: docs/teleop.md, "The emergency stop".
"""


class EmergencyStop:
    """Who presses. `kept`: what `kept` of the node before this one was, from wherever it was kept."""

    def __init__(self, kept=()):
        if isinstance(kept, (list, tuple)):
            self._pressing = dict.fromkeys(map(str, kept))
        else:
            self._pressing = {"somebody": None} if kept else {}  # set by hand: in doubt it is pressed

    @property
    def pressed(self):
        """Whether the robot has to stand."""
        return bool(self._pressing)

    @property
    def pressed_by(self):
        """Names of the nodes that press, the first one first."""
        return tuple(self._pressing)

    def hear(self, node, pressed, latched=False):
        """What a node says on the topic; `latched`: possibly long ago. Returns whether anything has changed."""
        if bool(pressed) == (node in self._pressing) or (latched and not pressed):
            return False
        if pressed:
            self._pressing[node] = None
        else:
            del self._pressing[node]
        return True

    def release(self):
        """A person's request. Returns whether anything has changed."""
        changed = self.pressed
        self._pressing.clear()
        return changed


class StandFirst:
    """Who has to stop once before he may drive: whoever has asked for motion and not stopped before the release.

    timeout: [s] after which silence counts as a stop. Times [s] are the caller's, from a clock that never goes back.
    """

    def __init__(self, timeout):
        self._timeout = timeout
        self._asked = {}   # when each sender has asked for motion for the last time, since its newest zero
        self._held = set()  # senders that have to stop first

    def press(self, now):
        """The emergency stop begins: who has fallen silent before does not ask for motion."""
        self._asked = {sender: at for sender, at in self._asked.items() if now - at < self._timeout}
        self._held.intersection_update(self._asked)

    def release(self, now):
        """It ends: from now on silence counts."""
        self._asked = dict.fromkeys(self._asked, now)
        self._held = set(self._asked)

    def admits(self, sender, moves, now):
        """Whether a sender's command counts; `moves`: whether it asks for motion."""
        if not moves:
            self._asked.pop(sender, None)
            self._held.discard(sender)
            return True
        silent = now - self._asked.get(sender, now) >= self._timeout
        self._asked[sender] = now
        if silent:
            self._held.discard(sender)
        return sender not in self._held

    def waiting(self, now):
        """Names of the senders that are held and ask for motion."""
        return sorted(sender for sender in self._held if now - self._asked[sender] < self._timeout)

    def excuse(self):
        """On a person's request: nobody has to stop first any more."""
        self._held.clear()
