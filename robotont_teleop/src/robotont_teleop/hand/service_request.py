"""Calls of services that a person asks for; each ends by itself, and none is carried out late."""

import threading

import rospy
from std_srvs.srv import Trigger, TriggerRequest

from robotont_driver.link.boot_clock import boot_time

OLDEST = 1.0   # [s] a service that could not be asked within this time is not asked any more
LONGEST = 3.0  # [s] after which a call without an answer has failed; an answer that comes later is ignored


class _Request(TriggerRequest):
    """Judged as it goes out: the master, or the network, may have held it up until then. unwanted(): why not, or ""."""

    def serialize(self, buff):
        """Called by rospy. Raises ValueError."""
        words = self.unwanted()
        if words:
            raise ValueError(words)
        super().serialize(buff)


class ServiceRequest:
    """Calls a std_srvs/Trigger; each call has threads and a connection of its own, and waits for no other.

    report(words): called with the answer, or with why there is none. unwanted(asked): why a request of the time `asked`
    [s] is not wanted any more, or "". done(asked): called instead of `report` when it was carried out. seen(): what the
    person has seen who asks, which the service hears as `seen` in the connection's header.
    """

    def __init__(self, service, what, report, unwanted=lambda asked: "", done=None, seen=lambda: ""):
        self._service, self._what, self._report, self._unwanted, self._done = service, what, report, unwanted, done
        self._seen = seen

    def call(self):
        """Call it; returns at once."""
        threading.Thread(target=self._call, args=[boot_time(), {"seen": self._seen()}], daemon=True).start()

    def _call(self, asked, headers):
        proxy = rospy.ServiceProxy(self._service, Trigger, persistent=True, headers=headers)  # others cannot be closed
        answers = []
        asking = threading.Thread(target=lambda: answers.append(self._answer(asked, proxy)), daemon=True)
        asking.start()
        asking.join(LONGEST)
        success, words = answers[0] if answers else (False, f"no answer within {LONGEST:g} s: ask again")
        proxy.close()  # ends the thread that still waits
        if success and self._done:
            self._done(asked)
        else:
            self._report(f"{self._what}: {words or 'done'}")

    def _answer(self, asked, proxy):
        """(whether it was carried out, words)."""
        try:
            proxy.wait_for_service(OLDEST)
            if boot_time() - asked > OLDEST:
                return False, "the master has answered too late"
            request = _Request()
            request.unwanted = lambda: "too late" if boot_time() - asked > LONGEST else self._unwanted(asked)
            answer = proxy(request)
            return answer.success, answer.message
        except Exception as error:  # rospy has its own kinds for each end of a connection
            return False, str(error)
