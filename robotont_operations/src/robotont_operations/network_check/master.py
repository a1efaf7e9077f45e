"""The master: whether it answers, what keeps it from answering, and which nodes it lists."""

from typing import NamedTuple
from urllib.parse import urlsplit

from robotont_operations import probes
from robotont_operations.network_check.findings import FAULT, GOOD, Finding, let_this_machine_in

CALLER = "/robotont_network"  # the name of this program in its questions to the master and to nodes
LOST_MASTER = Finding(FAULT, "master unreachable: it stopped answering in mid-check: check the Wi-Fi or the cable")


class Node(NamedTuple):
    """A node of the system: its name, and its announced address."""

    name: str
    host: str
    port: int


class Master:
    """The master that ROS_MASTER_URI names; `port` and `address` are None until `find` has found it."""

    def __init__(self, environment):
        self.uri = environment.get("ROS_MASTER_URI", "").rstrip("/") or "http://localhost:11311"
        self.port = self.address = None
        self._is_set = bool(environment.get("ROS_MASTER_URI"))

    def find(self):
        """Finding of whether it answers."""
        place = probes.master_place(self.uri)
        if place is None:
            return Finding(FAULT, f"wrong ROS_MASTER_URI: {self.uri!r} is no http://HOST:PORT: "
                                  "export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:11311")
        host, port = place
        address = probes.resolve(host)
        if address is None:
            return Finding(FAULT, f"unresolvable name: this machine finds no address of {host!r} (ROS_MASTER_URI): "
                                  f"export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:{port}, or add a line "
                                  f"'ADDRESS {host}' to /etc/hosts")
        where = f"{host} ({address})" if host != address else address
        fault = self._unreachable(where, address, port) or self._no_master(where, port)
        if fault:
            return Finding(FAULT, fault)
        self.port, self.address = port, address
        return Finding(GOOD, f"the master answers at {self.uri}")

    def _unreachable(self, where, address, port):
        """A message when no connection to the master's port is possible; else None."""
        outcome = probes.reach(address, port)
        if outcome == probes.OPEN:
            return None
        if outcome == probes.REFUSED and probes.is_loopback(address):
            return (f"master unreachable: no process listens at port {port} of this machine itself "
                    f"(ROS_MASTER_URI{'=' if self._is_set else ' is not set: '}"
                    f"{self.uri}): on a laptop: export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:{port}; "
                    "on the robot: start the stack")
        if outcome == probes.REFUSED:
            return (f"master unreachable: {where} answers, but no process listens at port {port}, or a firewall there "
                    "rejects: start the robot's stack there; if it runs, it keeps to itself (ROS_IP=127.0.0.1): "
                    "./robotont install-robot --network ADDRESS there; if it does so with that, on that machine, "
                    + let_this_machine_in(address))
        if outcome == probes.NO_ROUTE:
            return (f"master unreachable: this machine has no way to {where}: plug in the cable or join the robot's "
                    "Wi-Fi, then look at 'ip address'")
        if probes.is_there(address):
            return f"firewall: {where} answers, but not at port {port}: on that machine, {let_this_machine_in(address)}"
        return (f"master unreachable: no answer from {where}: is it switched on, in this network, its cable in? "
                f"ping {address}")

    def _no_master(self, where, port):
        """A message when the answer is not that of a ROS master; else None."""
        try:
            code, words, _ = probes.remote(self.uri, 1.0).getPid(CALLER)
        except (*probes.RPC_ERRORS, TypeError, ValueError) as error:  # the last two: no answer of three values
            code, words = -1, str(error)
        return None if code == 1 else (f"master unreachable: {where} port {port} answers, but not as a ROS master "
                                       f"({words}): check the port in ROS_MASTER_URI")

    def nodes(self):
        """Nodes that it lists, but for those of this program. Raises RPC_ERRORS."""
        master = probes.remote(self.uri, 1.0)
        state = master.getSystemState(CALLER)[2]
        names = sorted({name for kind in state for _, names in kind for name in names if not name.startswith(CALLER)})
        answers = [(name, master.lookupNode(CALLER, name)) for name in names]
        split = [(name, urlsplit(answer[2])) for name, answer in answers if answer[0] == 1]
        return [Node(name, uri.hostname, uri.port) for name, uri in split if uri.hostname and uri.port]
