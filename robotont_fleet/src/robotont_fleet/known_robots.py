"""All robots of a fleet as its page knows them, and the stops that it holds; free of network and clock.

A stop holds from when somebody gives it until somebody ends it, for who is there, comes back or comes anew. It is sent
until the robot's newest state says that it stands by it, and again as soon as it says so no more.
"""

import math
import secrets

from robotont_driver.robots.battery import EMPTY, LOW

REPEAT = 0.2          # [s] between two times that a stop is sent
FRESH = 1.5           # [s] after which a robot's word that it stands counts no more
SILENT = 5.0          # [s] a robot that is connected says nothing
# What a robot may need, the worst first, those up to "stopped" a person
NEEDS = ("namesakes", "waits", "silent", "no_driver", "error", "empty", "low", "stopped", "held", "warning", "", "gone")


class Robot:
    """One process of one robot."""

    def __init__(self, name, identity):
        self.name = name
        self.identity = identity
        self.present = False
        self.came = self.heard = -math.inf      # [s] its token, and its newest state
        self.state = {}


class Fleet:
    """send(name, order): tries to send an order (for JSON) to a robot. keep(kept): stores it. Neither waits.

    page: begins the numbers of its stops, by which it and no other page ends them. kept: what the Fleet before this one
    has had stored.
    """

    def __init__(self, send, page, keep=lambda kept: None, kept=None):
        kept = kept or {}
        self._send, self._page, self._store = send, page, keep
        self._all = kept.get("all")              # number of the stop for all, or None
        self._some = dict(kept.get("some", {}))  # {name: number} of stops for one
        self._newest = secrets.token_hex(4)      # names the newest press of STOP, so that no older release ends it
        self._robots = {name: {"": Robot(name, "")} for name in kept.get("names", ())}  # by name, identity

    # From robots

    def hear_token(self, name, identity, present, now):
        """A robot's liveliness token has come or gone, at time `now` [s]."""
        if present:
            self._come(name, identity, now)
        elif identity in self._robots.get(name, ()):
            self._robots[name][identity].present = False
            if self._present(name):
                del self._robots[name][identity]

    def _come(self, name, identity, now):
        alike, known = self._robots.get(name, {}), name in self._robots
        one = alike.get(identity, Robot(name, identity))
        one.present, one.came, one.state = True, now, {**one.state, "confirmed": []} if one.state else {}
        self._robots[name] = {identity: one, **{other.identity: other for other in self._present(name)}}
        self._send_stop(name)
        if self._all and not known:
            self._keep()

    def hear_state(self, name, state, now):
        """A robot's state (`read_state`) came. One of who never was there, or an older one, changes nothing."""
        one = self._robots.get(name, {}).get(state["id"])
        if one and state["number"] >= one.state.get("number", state["number"]):
            one.state, one.heard = state, now

    def _each(self):
        return [one for alike in self._robots.values() for one in alike.values()]

    def _present(self, name):
        return [one for one in self._robots.get(name, {}).values() if one.present]

    # Orders

    def knows(self, name):
        """Whether there is or was such a robot."""
        return name in self._robots

    def stop(self, name=None):
        """Stop one robot, or all: whoever is or will be there, until `release`."""
        self._newest = secrets.token_hex(4)
        if not self._all:
            number = f"{self._page}-{secrets.token_hex(4)}"
            if name:
                self._some.setdefault(name, number)
            else:
                self._all, self._some = number, {}
        for one in [name] if name else self._robots:
            self._send_stop(one)
        self._keep()

    def repeat(self, now):
        """Send the stops to who does not stand by them; to be called every REPEAT."""
        for name in self._robots:
            if not self._stands(name, now):
                self._send_stop(name)

    def release(self, newest):
        """End all stops, and let go the robots that are there and stand by one of this page or of nobody's.

        newest: of `view`, as the person has seen it who releases. Returns False, and does nothing, where somebody has
        pressed STOP since: a release may wait in a network longer than a press behind it.
        """
        if newest != self._newest:
            return False
        self._all, self._some = None, {}
        self._keep()
        for one in self._each():
            for number in self._own(one):
                self._send(one.name, {"kind": "release", "number": number, "id": one.identity,
                                      "seen": one.state["number"]})
        return True

    def cancel(self, name):
        """Take back the goals of a robot."""
        self._send(name, {"kind": "cancel"})

    def goal(self, name, **what):
        """Send a robot to ("x", "y") [m] on the map; "id", "seen": of its state that the user has seen."""
        self._send(name, {"kind": "goal", **what})

    def _wanted(self, name):
        return self._all or self._some.get(name)

    def _stands(self, name, now):
        """Whether each process of this name has just said that it stands by the stop that is wanted."""
        present = self._present(name)
        return bool(present) and all(now - one.heard <= FRESH and self._wanted(name) in one.state.get("confirmed", ())
                                     for one in present)

    def _own(self, one):
        """Numbers of the stops by which a robot stands that is there, of this page's, and of nobody's.

        A process that has ended has taken with it whose they were: the one behind it names itself.
        """
        confirmed = one.state.get("confirmed", ()) if one.present else ()
        return [number for number in confirmed if number.rpartition("-")[0] == self._page or number == one.identity]

    def _send_stop(self, name):
        if self._wanted(name) and self._present(name):
            self._send(name, {"kind": "stop", "number": self._wanted(name)})

    def _keep(self):
        self._store({"all": self._all, "some": dict(self._some), "names": sorted(self._robots)})

    # For pages

    def view(self, now):
        """Everything, for JSON; the robots that need somebody first."""
        robots = [{**one.state, "name": one.name, "id": one.identity, "present": one.present,
                   "age": round(now - one.heard, 1) if one.state else None, "need": self._need(one, now),
                   "asked": bool(self._wanted(one.name))} for one in self._each()]
        robots.sort(key=lambda one: (NEEDS.index(one["need"]), len(one["name"]), one["name"], one["id"]))
        asked = {*self._robots, *self._some} if self._all else set(self._some)
        stand = {name for name in asked if self._stands(name, now)}
        there = {one["name"] for one in robots if one["present"]}
        left = {one.name for one in self._each() if self._own(one)} - asked
        return {"robots": robots, "need": sum(NEEDS.index(one["need"]) <= NEEDS.index("stopped") for one in robots),
                "stop": {"all": bool(self._all), "newest": self._newest, "stand": sorted(stand),
                         "waiting": sorted(asked & there - stand), "gone": sorted(asked - there), "left": sorted(left)}}

    def _need(self, one, now):
        """One of NEEDS: the first of `found` that is true."""
        state, charge = one.state, (one.state.get("battery") or {}).get("charge")
        level, wanted = (state.get("worst") or {"level": 0})["level"], self._wanted(one.name)
        found = {"gone": not one.present, "namesakes": state.get("namesakes") or len(self._present(one.name)) > 1,
                 "waits": wanted and not self._stands(one.name, now), "silent": now - max(one.came, one.heard) > SILENT,
                 "no_driver": state and not state["driver"], "error": level >= 2,
                 "empty": charge is not None and charge <= EMPTY, "low": charge is not None and charge <= LOW,
                 "held": wanted, "stopped": state.get("stopped"), "warning": level == 1}
        return next((need for need, there in found.items() if there), "")
