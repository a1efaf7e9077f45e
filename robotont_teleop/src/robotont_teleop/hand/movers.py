"""Who moves the robot now, by what comes on its topics of commands; free of ROS and clock.

Times [s] are the caller's, from a clock that never goes back.
"""

RECENT = 0.6  # [s] after its last motion a sender still counts as moving: longer than the driver's time-out
KINDS = {"hand": "hand", "navigation": "navigation", "default": "program"}  # by the mux's input


class Movers:
    """own: name of this node. mux: name of the one node that is expected on cmd_vel."""

    def __init__(self, own, mux):
        self._own, self._mux = own, mux
        self._moving = {}  # (topic, sender): [s] its newest command other than zero

    def hear(self, topic, sender, moves, now):
        """A command has come; `moves`: whether it asks for motion."""
        if moves:
            self._moving[topic, sender] = now
        else:
            self._moving.pop((topic, sender), None)

    def who(self, driven_by, now):
        """(kind, name): "program", "navigation", "page" (of this node) or "hand" and a node; or "nobody" and "".

        driven_by: what the mux says; of navigation it alone counts. Whoever publishes straight on cmd_vel moves the
        robot, too, whatever it says.
        """
        moving = [key for key, at in tuple(self._moving.items()) if now - at < RECENT]  # others hear meanwhile
        past = {sender for topic, sender in moving if topic == "cmd_vel"} - {self._mux}
        senders = past or {sender for topic, sender in moving if topic == f"cmd_vel/{driven_by}"}
        kind = "program" if past else KINDS.get(driven_by, "nobody")
        if kind == "hand" and self._own in senders:
            return "page", ""
        if kind == "hand" and not senders:
            return "nobody", ""
        return kind, ", ".join(sorted(sender.lstrip("/") for sender in senders))[:80]
