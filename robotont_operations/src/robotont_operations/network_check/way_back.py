"""The way back: whether the master can call this machine, as it does whenever a topic gets a new publisher."""

import contextlib
import os
import threading
import xmlrpc.server

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, Finding
from robotont_operations.network_check.master import CALLER, LOST_MASTER

FAREWELL = 0.4  # [s] in which it unregisters itself
PATIENCE = 1.5  # [s] for the master's call
POLLING = 0.05  # [s] that the end of the server may take


class WayBack:
    """Registers a topic of its own with the master, waits for its call, and unregisters.

    announced: the address or name that this machine announces; own: its address towards the master.
    """

    def __init__(self, master, announced, own):
        self._master = master
        self._announced = announced
        self._own = own
        self._called = threading.Event()

    def cancel(self):
        """Let `check` unregister and end at once."""
        self._called.set()

    def check(self, report):
        """Report whether the master's call arrives; nothing where what this machine announces cannot be right."""
        address = probes.resolve(self._announced)
        if address is None or probes.is_loopback(address) or not probes.is_own(address):
            return
        server = xmlrpc.server.SimpleXMLRPCServer(("0.0.0.0", 0), logRequests=False)
        server.register_function(lambda *_: self._called.set() or (1, "", 0), "publisherUpdate")
        threading.Thread(target=server.serve_forever, args=(POLLING,), daemon=True).start()
        try:
            heard = self._is_called(f"http://{self._announced}:{server.server_address[1]}/")
        except probes.RPC_ERRORS:
            report(LOST_MASTER)
            return
        finally:
            server.shutdown()
            server.server_close()
        if heard:
            report(Finding(GOOD, "the master's machine reaches this one"))
        elif self._announced == self._own:
            report(Finding(FAULT, f"one-way traffic: this machine reaches {self._master.address}, but not the other "
                                  f"way round (at {self._own}): on this machine, sudo ufw allow from "
                                  f"{self._master.address}"))
        else:
            report(Finding(FAULT, f"wrong ROS_IP/ROS_HOSTNAME: the master's machine does not reach this one as "
                                  f"{self._announced!r}: export ROS_IP={self._own}; if that does not help, "
                                  f"sudo ufw allow from {self._master.address}"))

    def _is_called(self, uri):
        """Whether the master calls this URI, which is registered meanwhile. Raises RPC_ERRORS."""
        topic, caller = f"{CALLER}/way_back_{os.getpid()}", f"{CALLER}_{os.getpid()}"
        calls = probes.remote(self._master.uri, 1.0)
        try:
            calls.registerSubscriber(caller, topic, "std_msgs/Empty", uri)
            calls.registerPublisher(caller, topic, "std_msgs/Empty", uri)
            return self._called.wait(PATIENCE)
        finally:
            with contextlib.suppress(*probes.RPC_ERRORS):
                farewell = probes.remote(self._master.uri, FAREWELL)
                farewell.unregisterSubscriber(caller, topic, uri)
                farewell.unregisterPublisher(caller, topic, uri)
