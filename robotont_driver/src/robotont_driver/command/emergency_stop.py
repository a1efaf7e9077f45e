"""The emergency stop: who presses it, what releases it, who has to stop first behind it; the rule: docs/safety.md."""

import math


class EmergencyStop:
    """Who presses. `kept`: `pressed_by` of the node before this one, from wherever it was kept.

    A node may be heard by several connections, of which an older one may bring late what was said before. So a press
    stands until the connection by which it came takes it back, or one that was made after it was heard.
    """

    def __init__(self, kept=()):
        if not isinstance(kept, (list, tuple)):
            kept = ["somebody"] if kept else []  # set by hand: in doubt it is pressed
        self._presses = {str(node): {None: 0} for node in kept}  # by node: {connection: the newest one at the press}

    @property
    def pressed(self):
        """Whether the robot has to stand."""
        return bool(self._presses)

    @property
    def pressed_by(self):
        """Names of the nodes that press, the first one first."""
        return tuple(self._presses)

    def hear(self, node, pressed, latched, connection, newest):
        """What a node says on the topic; `latched`: possibly long ago. Returns whether anything has changed.

        connection: its number, which rise as they are made; None: it has ended. newest: that of the newest of all.
        """
        if pressed:
            changed = node not in self._presses
            self._presses.setdefault(node, {})[connection] = newest
            return changed
        if latched or connection is None or node not in self._presses:
            return False
        presses = self._presses[node]
        for one, since in list(presses.items()):
            if one == connection or since < connection:
                del presses[one]
        if not presses:
            del self._presses[node]
        return not presses

    def release(self):
        """A person's request. Returns whether anything has changed."""
        changed = self.pressed
        self._presses.clear()
        return changed


RECONNECTING = 5.0  # [s] for which a new process does not take silence for a stop


class StandFirst:
    """Who has to stop once before he may drive: whoever has asked for motion and not stopped before the release."""

    def __init__(self, timeout, held=(), now=0.0):
        self._timeout = timeout  # [s] after which silence counts as a stop
        # when each sender has asked for motion for the last time, since its newest zero; held: of the process before
        self._asked = dict.fromkeys(held, now + RECONNECTING - timeout)
        self._held = set(held)  # senders that have to stop first

    def press(self, now):
        """The emergency stop begins: who has fallen silent before does not ask for motion."""
        self._asked = {sender: at for sender, at in self._asked.items() if now - at < self._timeout}
        self._held = set(self._asked)  # also in the process behind this one, which may be released unheard

    def release(self, now):
        """It ends: from now on silence counts."""
        self._asked = {sender: max(at, now) for sender, at in self._asked.items()}
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
        """Names of the senders that are held and ask for motion; in any thread."""
        return sorted(sender for sender in tuple(self._held)
                      if now - self._asked.get(sender, -math.inf) < self._timeout)

    def excuse(self):
        """On a person's request: nobody has to stop first any more."""
        self._held.clear()
