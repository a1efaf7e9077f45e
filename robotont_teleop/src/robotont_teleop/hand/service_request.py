"""Calls of services that a person asks for; none is ever carried out late."""

import threading
import time

import rospy
from std_srvs.srv import Trigger

OLDEST = 1.0  # [s] a service that could not be asked within this time is not asked any more


class ServiceRequest:
    """Calls a std_srvs/Trigger in a thread of its own, and never a second time before it has answered.

    report(words): called with the answer, or with why there is none. unwanted(asked): why a request of the time `asked`
    [s] is not wanted any more, or "". done(asked): called instead of `report` when it was carried out.
    """

    def __init__(self, service, what, report, unwanted=lambda asked: "", done=None):
        self._service = rospy.ServiceProxy(service, Trigger)
        self._what, self._report, self._unwanted, self._done = what, report, unwanted, done
        self._free = threading.Lock()

    def call(self):
        """Call it, or report that it has not yet answered the call before; returns at once."""
        threading.Thread(target=self._call, args=[time.monotonic()], daemon=True).start()

    def _call(self, asked):
        if not self._free.acquire(blocking=False):
            self._report(f"{self._what}: no answer yet to the request before")
            return
        try:
            success, words = self._answer(asked)
        finally:
            self._free.release()
        if success and self._done:
            self._done(asked)
        else:
            self._report(f"{self._what}: {words or 'done'}")

    def _answer(self, asked):
        """(whether it was carried out, words)."""
        try:
            self._service.wait_for_service(OLDEST)
            if time.monotonic() - asked > OLDEST:
                return False, "the master has answered too late"
            unwanted = self._unwanted(asked)
            answer = None if unwanted else self._service()
            return (answer.success, answer.message) if answer else (False, unwanted)
        except Exception as error:  # rospy has its own kinds for each end of a connection
            return False, str(error)
