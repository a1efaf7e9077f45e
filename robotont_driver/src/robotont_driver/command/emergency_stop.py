"""The emergency stop: who presses it and what releases it; free of ROS and clock.

The rule: docs/safety.md, "The emergency stop".
"""


class EmergencyStop:
    """Who presses. `kept`: what `kept` of the node before this one was, from wherever it was kept.

    A node may be heard by several connections, of which an older one may bring late what was said before. So
    connections have numbers that rise as they are made. A press stands until the connection by which it came takes it
    back, or one that was made after it was heard: whatever that one brings is newer.
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

        connection: number of the one by which it says so; None: it has ended. newest: number of the newest of all.
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
