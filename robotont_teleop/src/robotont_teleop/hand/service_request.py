"""Requests of a page that take their time, goals and calls of services; none is ever carried out late."""

import threading
import time

import rospy

from robotont_driver.ros.worker import Worker

OLDEST_REQUEST = 1.0  # [s] a service that could not be asked within this time is not asked any more


def call_in_time(service, asked, still_wanted=lambda: ""):
    """Answer of a ServiceProxy that somebody asked for at the time `asked` [s].

    still_wanted: gives the reason why it is not wanted any more. Raises rospy.ServiceException when it is too late, not
    wanted, or refused.
    """
    try:
        service.wait_for_service(OLDEST_REQUEST)
    except (rospy.ROSException, OSError) as error:
        raise rospy.ServiceException(str(error)) from error
    if time.monotonic() - asked > OLDEST_REQUEST:
        raise rospy.ServiceException("the master has answered too late")
    if still_wanted():
        raise rospy.ServiceException(still_wanted())
    answer = service()
    if not answer.success:
        raise rospy.ServiceException(answer.message)
    return answer


class NewestGoal:
    """Sends the newest goal by goto's client; one that it replaces is dropped, wherever it is on its way.

    `goto`: GoTo; `report(words)` is called when a goal has ended and no newer one has taken its place.
    """

    def __init__(self, goto, report):
        self._goto = goto
        self._report = report
        self._changed = threading.Condition()
        self._wanted = None  # Goal that is neither sent nor refused yet
        self._shown = None   # {"x" [m], "y" [m], "words"} of the one that is pursued
        Worker(self._pursue)

    @property
    def shown(self):
        """{"x" [m], "y" [m], "words"} of the goal that is pursued, or None."""
        return self._shown

    def pursue(self, goal):
        """Send the robot to a Goal, in place of the one before."""
        with self._changed:
            self._wanted = goal
            self._goto.leave()
            self._changed.notify()

    def cancel(self):
        """Take the goal back, sent or not."""
        with self._changed:
            self._wanted = None
            self._goto.leave(cancel=True)

    def show_progress(self, words):
        """Called by goto's client."""
        shown = self._shown
        if shown is not None:
            self._shown = {**shown, "words": words}

    def _pursue(self):
        """Pursue the newest goal to its end; returns the time to rest."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._wanted is not None, timeout=1.0):
                return 0.0
            goal = self._wanted
            self._shown = {"x": goal.x, "y": goal.y, "words": ""}
        outcome = self._goto.check(goal)
        with self._changed:
            if self._wanted is not goal:  # replaced or taken back meanwhile
                self._shown = None
                return 0.0
            self._wanted = None
            if outcome:
                self._goto.leave(cancel=True)  # the robot must not go on to the goal before
            else:
                pursuit = self._goto.send(goal)
        outcome = outcome or self._goto.follow(pursuit, 0.0)
        with self._changed:
            replaced = self._wanted is not None
            self._shown = None  # also where it is replaced: the newer goal may be cancelled before its turn
        if not replaced:
            self._report(outcome.words)
        return 0.0


class ServiceRequest:
    """Calls a service without arguments in a thread of its own, and never a second time before it has answered."""

    def __init__(self, service, what, kind, report):
        self._service = rospy.ServiceProxy(service, kind)
        self._what = what
        self._report = report
        self._free = threading.Lock()

    def call(self):
        """Call it, or report that it has not yet answered the call before."""
        if self._free.acquire(blocking=False):
            threading.Thread(target=self._call, daemon=True).start()
        else:
            self._report(f"{self._what}: no answer yet to the request before")

    def _call(self):
        try:
            answer = call_in_time(self._service, time.monotonic())
            self._report(f"{self._what}: {answer.message or 'done'}")
        except rospy.ServiceException as error:
            self._report(f"{self._what}: {error}")
        finally:
            self._free.release()
