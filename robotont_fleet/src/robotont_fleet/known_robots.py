"""All robots of a fleet as its page knows them, and the stops that it waits for; free of network and clock.

A stop is a wish that holds, and is repeated, until the robot has said that it stands by it.
"""

import itertools
import json
import math
import secrets

MOST = 300            # robots that are remembered; the longest gone are forgotten first
REPEAT = 0.2          # [s] between two times that a stop is sent
SILENT = 5.0          # [s] a robot that is connected says nothing
LARGEST_STATE = 16384  # [bytes]


class Robot:
    """One process of one robot."""

    def __init__(self, name, identity):
        self.name = name
        self.identity = identity
        self.present = False
        self.heard = -math.inf  # [s] its newest state
        self.state = {}


class Fleet:
    """send(name, order): tries to send an order (for JSON) to a robot, and never waits."""

    def __init__(self, send):
        self._send = send
        self._robots = {}     # by (name, identity)
        self._wishes = {}     # name: number of the stop that it has not confirmed
        self._asked = set()   # names whom the newest STOP was for
        self._numbers = (f"{secrets.token_hex(4)}-{number}" for number in itertools.count(1))

    # From robots

    def hear_token(self, name, identity, present):
        """A robot's liveliness token has come or gone."""
        self._robot(name, identity).present = present
        if present:  # it was started again: what was it before is gone
            for key in [key for key, one in self._robots.items() if one.name == name and not one.present]:
                del self._robots[key]
        for key in sorted((key for key, one in self._robots.items() if not one.present),
                          key=lambda key: self._robots[key].heard)[:max(0, len(self._robots) - MOST)]:
            del self._robots[key]

    def hear_state(self, name, payload, now):
        """A robot's state came at time `now` [s]."""
        state = read_state(payload)
        if state is None:
            return
        robot = self._robot(name, state["id"])
        robot.state, robot.heard = state, now
        if name in self._wishes and all(one.state.get("confirmed") == self._wishes[name] for one in self._all(name)):
            del self._wishes[name]

    def _robot(self, name, identity):
        return self._robots.setdefault((name, identity), Robot(name, identity))

    def _all(self, name):
        return [one for one in self._robots.values() if one.name == name and one.present]

    # Orders

    def stop(self, name=None):
        """Stop one robot, or all that are present; also those of one name that come back before they have confirmed."""
        self._asked = {name} if name else {one.name for one in self._robots.values() if one.present}
        for one in self._asked:
            self._wishes[one] = next(self._numbers)
        self.repeat()

    def repeat(self):
        """Send the stops that are not confirmed; to be called every REPEAT."""
        for name, number in self._wishes.items():
            if self._all(name):
                self._send(name, {"kind": "stop", "number": number})

    def cancel(self, name):
        """Take back the goals of a robot."""
        self._send(name, {"kind": "cancel"})

    def goal(self, name, identity, seen, x, y):
        """Send a robot to (x, y) [m] on the map; seen: number of the state that the user has seen."""
        self._send(name, {"kind": "goal", "id": identity, "seen": seen, "x": x, "y": y})

    # For pages

    def view(self, now):
        """Everything, for JSON."""
        robots = [{**one.state, "name": one.name, "id": one.identity, "present": one.present,
                   "age": None if one.heard == -math.inf else round(now - one.heard, 1),
                   "silent": one.present and now - one.heard > SILENT,
                   "stopping": one.name in self._wishes} for one in self._robots.values()]
        present = {one.name for one in self._robots.values() if one.present}
        waiting = set(self._wishes) & present
        return {"robots": sorted(robots, key=lambda one: (len(one["name"]), one["name"], one["id"])),
                "stop": {"asked": len(self._asked), "stand": len(self._asked - set(self._wishes)),
                         "waiting": sorted(waiting), "gone": sorted(set(self._wishes) - present)}}


def read_state(payload):
    """What a robot has said, of which nothing else than expected is believed; None where it is no state."""
    try:
        if len(payload) > LARGEST_STATE:
            return None
        given = json.loads(payload)
        return {"id": _text(given["id"]), "number": int(given["number"]), "frame": _text(given["frame"]),
                "pose": _numbers(given["pose"], 3), "speed": _numbers(given["speed"], 2),
                "driven": _number(given["driven"]), "driven_by": _text(given["driven_by"]),
                "stopped": _text(given["stopped"]), "confirmed": given["confirmed"] and _text(given["confirmed"]),
                "worst": given["worst"] and [int(given["worst"][0]), *map(_text, given["worst"][1:3])],
                "battery": given["battery"] and {name: _number(given["battery"].get(name)) for name in
                                                 ("voltage", "charge")},
                "page": given["page"] if str(given["page"]).startswith(("http://", "https://")) else "",
                "versions": {_text(name): _text(value) for name, value in list(given["versions"].items())[:5]},
                "note": _text(given["note"]), "namesakes": int(given["namesakes"])}
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None


def _text(value):
    return str(value)[:200]


def _number(value):
    number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return value if number else None


def _numbers(values, amount):
    numbers = [_number(value) for value in values or ()]
    return numbers if len(numbers) == amount and None not in numbers else None
