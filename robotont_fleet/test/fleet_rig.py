"""Robots on stand-in boards, each in the namespace of its name, and a fleet page, all of this computer."""

import json
import signal
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path

from robotont_testing import places
from robotont_testing.harness import Master, free_port, wait_for
from robotont_testing.loop_client import LoopClient
from robotont_testing.robots import SHIPPED
from robotont_testing.stalling_proxy import StallingProxy
from robotont_testing.stand_in_board import COMMAND_TIMEOUT, Board, speeds_of

PATIENCE, TO_WHEELS = 60.0, 0.2  # [s]
STATE = {"id": "a", "number": 1, "frame": "map", "pose": [1, 2, 3], "speed": [0.1, 0.0], "driven": 0.0,
         "driven_by": "hand", "driver": True, "stopped": "", "confirmed": [],
         "worst": {"level": 0, "task": "link", "words": "ok", "fault": ""},
         "battery": {"voltage": 15.0, "charge": 0.5}, "page": "", "note": "",
         "namesakes": 0}  # what a robot says of itself


class Rig(Master):
    """All processes; robots are added one by one, as RobotRigs."""

    def __init__(self):
        super().__init__()
        self.router_port, self.port = free_port(), free_port()
        self.home = self.folder / "home"
        self.page, self._client = None, LoopClient(self.port)
        self.robots = {}

    def start_page(self, *arguments):
        log = self.folder / "page.log"
        self.page = self.start(places.program("robotont_fleet", "fleet"), "--port", self.port, "--router-port",
                               self.router_port, *arguments, log=log, ROS_HOME=str(self.home))
        wait_for(lambda: "robots connect to " in log.read_text() or self.page.poll() is not None, "the page", PATIENCE)
        assert self.page.poll() is None, log.read_text()

    def request(self, method, path, body=None):
        return self._client.request(method, path, body, Origin=f"http://127.0.0.1:{self.port}")

    def view(self):
        return json.loads(self.request("GET", "/robots")[2])

    def seen(self, name):
        """The newest state of a robot that is present, or {}: between its token and its first state there is none."""
        return next((one for one in self.view()["robots"] if one["name"] == name and one["present"]
                     and one["age"] is not None), {})

    def order(self, **fields):
        if fields["kind"] == "release":
            fields["newest"] = self.stop_state()["newest"]
        assert self.request("POST", "/order", json.dumps(fields))[0] == 204

    def stop_state(self):
        return self.view()["stop"]

    def release(self):
        """All drive again, also those that were gone at the first time."""
        def free():
            drives = [robot.drives for robot in self.robots.values()]
            if not all(drives) or self.stop_state()["left"]:
                self.order(kind="release")
            return all(drives)
        wait_for(free, "all to drive", PATIENCE, period=0.3)

    def close(self):
        for robot in self.robots.values():
            robot.board.close()
            robot.proxy.close()
        super().close()


class RobotRig:
    def __init__(self, rig, name):
        self._rig, self.name = rig, name
        self.board = Board(str(rig.folder / f"{name}.port"))
        self.proxy = StallingProxy(rig.router_port, room=4096)
        rig.start(sys.executable, Path(__file__).with_name("stand_in_navigation.py"), f"__ns:=/{name}")
        rig.robots[name] = self
        self.start()

    def start(self):
        self.board.plug()
        self._rig.load({**SHIPPED, "serial_com_node": {"port": self.board.link}}, "/" + self.name)
        self._driver = self._rig.node("robotont_node", f"__ns:=/{self.name}")
        self.start_fleet_node()

    def fall(self):
        """Its supply fails, that of its master, too."""
        for process in (self.fleet_node, self._driver):
            self._rig.stop(process, signal.SIGKILL)
        xmlrpc.client.ServerProxy(self._rig.uri).deleteParam("/rig", "/" + self.name)
        self.board.unplug()
        self.board.restart()

    def start_fleet_node(self, router_port=None):
        self.fleet_node = self._rig.start(
            places.program("robotont_fleet", "fleet_node"), f"__ns:=/{self.name}",
            f"_router:=tcp/127.0.0.1:{router_port or self.proxy.port}", log=self._rig.folder / f"{self.name}.log",
            ROS_HOME=str(self._rig.folder / f"{self.name}.home"))

    def release(self):
        """By a person beside the robot."""
        subprocess.run(["rosservice", "call", f"/{self.name}/emergency_stop/release"], check=True, capture_output=True)

    def words(self):
        return (self._rig.folder / f"{self.name}.log").read_text()

    @property
    def drives(self):
        return any(self.board.speeds)

    def stood_at(self):
        """[s] when the newest motion of its wheels ended: with the next command, or with the board's time-out."""
        heard = list(self.board.heard)
        newest = max(number for number, (_, line) in enumerate(heard) if any(speeds_of(line.encode(), 3) or ()))
        return min(heard[newest][0] + COMMAND_TIMEOUT, *(when for when, _ in heard[newest + 1:]), time.monotonic())


def watch_stop(rig, reached):
    """[s] of each robot from when it could be reached until its wheels stood, once the page says so of all.

    reached(view): {name: when [s]} of those that can be. Fails where the page says more than is true: zeros may take
    TO_WHEELS from driver_node to the wheels.
    """
    since, told = {}, {}

    def all_stand():
        view = rig.view()
        since.update({name: when for name, when in reached(view).items() if name not in since})
        told.update({name: time.monotonic() for name in view["stop"]["stand"] if name not in told})
        return set(view["stop"]["stand"]) == set(rig.robots)
    wait_for(all_stand, "all to stand by the page's word", PATIENCE)
    time.sleep(0.3)
    stood = {name: robot.stood_at() for name, robot in rig.robots.items()}
    assert not [name for name, when in stood.items() if when > told[name] + TO_WHEELS], "the page says that it stands"
    return [max(0.0, when - since.get(name, when)) for name, when in stood.items()]
