"""A robot and a laptop with a cable between them, out of Linux namespaces (without root where users may make them)."""

import os
import shutil
import subprocess
import sys
import unittest

from robotont_testing import slow_link
from robotont_testing.harness import Processes, wait_for

ADDRESSES = {"robot": "10.77.0.1", "laptop": "10.77.0.2"}
HOSTS = "127.0.0.1 localhost\n10.77.0.1 robot\n10.77.0.2 laptop\n"
TOOLS = ("unshare", "nsenter", "ip")


class NoMachinesError(unittest.SkipTest):
    """Namespaces cannot be made here, or their firewall; holds the reason. pytest skips what raises it."""


class TwoMachines(Processes):
    """Each machine has a network, a host name, /etc/hosts and /etc/resolv.conf of its own; the rest they share.

    They reach each other through a switch, whose ports lose their carrier when the cable is cut. No name server
    answers. What ROS' variables name in this process is forgotten.
    slow: through a `slow_link` instead, whose delay and loss `link` sets.
    Raises NoMachinesError with the reason.
    """

    def __init__(self, slow=False):
        super().__init__()
        for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_MASTER_URI"):
            os.environ.pop(name, None)
        self._slow = slow
        lacking = [tool for tool in TOOLS if not shutil.which(tool)]
        if lacking:
            raise NoMachinesError("these commands are missing: " + ", ".join(lacking))
        self._pids = {}
        self._enter = ["-U", "--preserve-credentials"] if os.getuid() else []
        try:
            self._make()
        except (subprocess.CalledProcessError, AssertionError) as error:
            super().close()  # not that of a class made of this, which is not complete yet
            raise NoMachinesError(f"no namespaces here: {getattr(error, 'stderr', '') or error}".strip()) from None

    def _make(self):
        self._hold("switch", ["unshare", *(["--user", "--map-root-user"] if os.getuid() else [])])
        self._ip("switch", "link add bridge type bridge")
        self._ip("switch", "link set bridge up")
        for name in ADDRESSES:
            self._hold(name, [*self._inside("switch"), "unshare"])
        if self._slow:
            self._make_slow_link()
        for name, address in ADDRESSES.items():
            if not self._slow:
                self._ip("switch", f"link add {name} type veth peer name eth0 netns {self._pids[name]}")
                self._ip("switch", f"link set {name} master bridge up")
            self._ip(name, "link set lo up")
            self._ip(name, f"address add {address}/24 dev eth0")
            self._ip(name, "link set eth0 up")
            self.check(name, "hostname", name)
            for file, text in (("hosts", HOSTS), ("resolv.conf", f"nameserver {address[:-1]}9\n")):
                own = self.folder / f"{file}.{name}"
                own.write_text(text)
                self.check(name, "mount", "--bind", own, f"/etc/{file}")
        wait_for(lambda: self.run("laptop", "ip", "-o", "link", "show", "eth0", "up").stdout.count("LOWER_UP"),
                 "the carrier of the laptop's cable")

    def _make_slow_link(self):
        self.link(0.0, 0.0)
        log = self.folder / "slow_link"
        process = self.on("switch", sys.executable, slow_link.__file__, self.folder / "link",
                          *(self._pids[name] for name in ADDRESSES), log=log)
        wait_for(lambda: "ready" in log.read_text() or process.poll() is not None, "the slow link")
        if process.poll() is not None:
            raise AssertionError(log.read_text())

    def _hold(self, name, unshare):
        ready = self.folder / (name + ".ready")
        holder = self.start(*unshare, "--net", "--mount", "--uts", "sh", "-c", f"echo $$ >{ready}; exec sleep infinity",
                            log=self.folder / (name + ".log"))
        wait_for(lambda: holder.poll() is not None or (ready.exists() and ready.read_text().strip()), "a namespace")
        if holder.poll() is not None:
            raise AssertionError((self.folder / (name + ".log")).read_text())
        self._pids[name] = int(ready.read_text())

    def _inside(self, name):
        return ["nsenter", "--target", str(self._pids[name]), *self._enter, "--net", "--mount", "--uts", "--"]

    def _ip(self, name, words):
        self.check(name, "ip", *words.split())

    def environment(self, name):
        """Variables of a ROS node on a machine, with a master on the robot."""
        return {"ROS_MASTER_URI": f"http://{ADDRESSES['robot']}:11311", "ROS_IP": ADDRESSES[name],
                "ROS_LOG_DIR": str(self.folder)}

    def on(self, name, *command, log=None, **environment):
        """Start a process on a machine; returns its Popen."""
        return self.start(*self._inside(name), *command, log=log, **environment)

    def run(self, name, *command, timeout=60.0, **environment):
        """Run a command on a machine to its end; a CompletedProcess with its output."""
        words = [*self._inside(name), *map(str, command)]
        return subprocess.run(words, env={**os.environ, **environment}, timeout=timeout, check=False, text=True,
                              stdin=subprocess.DEVNULL, capture_output=True)

    def check(self, name, *command):
        """As `run`; raises subprocess.CalledProcessError when the command fails."""
        done = self.run(name, *command)
        done.check_returncode()
        return done

    def hosts(self, name, text):
        """Replace a machine's /etc/hosts."""
        (self.folder / f"hosts.{name}").write_text(text)

    def link(self, delay, loss):
        """From now on the slow link delays packets by `delay` [s] each way, and loses the share `loss` of them."""
        (self.folder / "link.new").write_text(f"{delay} {loss}")
        (self.folder / "link.new").rename(self.folder / "link")

    def cut(self, carrier=False):
        """Cut the cable; with `carrier` the machines do not notice, as when a Wi-Fi loses them."""
        for port in ["bridge"] if carrier else ADDRESSES:
            self._ip("switch", f"link set {port} down")

    def mend(self):
        """Mend the cable."""
        for port in ("bridge", *ADDRESSES):
            self._ip("switch", f"link set {port} up")

    def block(self, name, rule):
        """A firewall on a machine that drops what a rule of nftables (of its input) matches."""
        if not shutil.which("nft"):
            raise NoMachinesError("no nft: sudo apt-get install nftables")
        for words in ("add table inet firewall",
                      "add chain inet firewall input { type filter hook input priority 0 ; }",
                      f"add rule inet firewall input {rule} drop"):
            self.check(name, "nft", *words.split())

    def open_firewall(self, name):
        """Remove the rules of `block`."""
        self.check(name, "nft", "delete", "table", "inet", "firewall")
