"""Orders that have come and wait to be carried out."""

import threading

MOST = 16  # kinds


class Mailbox:
    """Orders that wait, of each kind the newest only: however many come, none waits long and no memory fills."""

    def __init__(self):
        self._orders = {}
        self._changed = threading.Condition()

    def put(self, kind, order):
        """An order has come; any number of threads may put. One of the same kind that still waits is gone."""
        with self._changed:
            self._orders.pop(kind, None)
            self._orders[kind] = order
            if len(self._orders) > MOST:
                del self._orders[next(iter(self._orders))]
            self._changed.notify()

    def take(self):
        """The one that waits longest; waits for one."""
        with self._changed:
            self._changed.wait_for(lambda: self._orders)
            return self._orders.pop(next(iter(self._orders)))
