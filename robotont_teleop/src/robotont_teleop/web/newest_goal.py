"""Goals of pages: the newest is pursued, none is carried out late."""

import threading

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_map_navigation.goal import Outcome, Status

OLDEST = 3.0  # [s] of a goal that goes out: to check it asks the master, which may be gone or hang


class NewestGoal:
    """Sends the newest goal by goto's client; one that it replaces is dropped, wherever it is on its way.

    `goto`: GoTo; `report(words)` is called when a goal has ended and no newer one has taken its place.
    """

    def __init__(self, goto, report):
        self._goto = goto
        self._report = report
        self._changed = threading.Condition()
        self._wanted = None  # Goal that is neither sent nor refused yet, asked for ...
        self._asked = 0.0    # [s] ... then
        self.shown = None    # {"x" [m], "y" [m], "words"} of the one that is pursued
        RepeatingThread(self._pursue)

    def pursue(self, goal):
        """Send the robot to a Goal, in place of the one before."""
        with self._changed:
            self._wanted, self._asked = goal, boot_time()
            self._goto.leave()
            self._changed.notify()

    def cancel(self):
        """Take the goal back, sent or not."""
        with self._changed:
            self._wanted = None
            self._goto.leave(cancel=True)

    def show_progress(self, words):
        """Called by goto's client."""
        shown = self.shown
        if shown is not None:
            self.shown = {**shown, "words": words}

    def _pursue(self):
        """Pursue the newest goal to its end; returns the time to rest."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._wanted is not None, timeout=1.0):
                return 0.0
            goal = self._wanted
            self.shown = {"x": goal.x, "y": goal.y, "words": ""}
        outcome = self._goto.check(goal)
        with self._changed:
            if self._wanted is not goal:  # replaced or taken back meanwhile
                self.shown = None
                return 0.0
            self._wanted = None
            if boot_time() - self._asked > OLDEST:
                outcome = Outcome(Status.NOT_THERE, "not sent, for the ROS master has answered too late: send it again")
            if outcome:
                self._goto.leave(cancel=True)  # the robot must not go on to the goal before
            else:
                self._goto.send(goal)
        outcome = outcome or self._goto.follow(goal)
        with self._changed:
            replaced = self._wanted is not None
            self.shown = None  # also where it is replaced: the newer goal may be cancelled before its turn
        if not replaced:
            self._report(outcome.words)
        return 0.0
