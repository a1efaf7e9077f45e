"""A server of the page in this process with a robot that only writes down, and a rude client."""

import contextlib
import json
import time
from types import SimpleNamespace

from nav_msgs.msg import MapMetaData, OccupancyGrid
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from robotont_teleop.hand.speeds import Speeds
from robotont_teleop.web.access import Access
from robotont_teleop.web.driving_seat import DrivingSeat
from robotont_teleop.web.web_server import WebServer
from robotont_testing.harness import wait_for
from robotont_testing.loop_client import LoopClient

PATIENCE = 10.0  # [s]
TOKEN = "the-token-of-these-tests"
SPEEDS = Speeds(0.5, 2.0)


class NotedRobot:
    """Stands in for RobotView: writes down what it is asked for."""

    map_picture = b"\x89PNG"
    camera = SimpleNamespace(picture=lambda: None)
    name = "Robotont"

    def __init__(self):
        self.sent, self.orders = [], []
        self.send = self.sent.append
        self.told = {}  # what differs, of its state and of its status
        self.emergency_stop = SimpleNamespace(press=self._press, release=self._release, pressed=False, pressed_at=0.0)

    def __getattr__(self, name):
        if name not in ("goal", "cancel", "give_back", "reset_odometry"):
            raise AttributeError(name)
        return lambda *values: self.orders.append((name, *values))

    def _press(self):
        self.orders.append(("press",))
        self.emergency_stop.pressed, self.emergency_stop.pressed_at = True, time.monotonic()

    def _release(self):
        self.orders.append(("release",))
        self.emergency_stop.pressed = False

    @property
    def stopped(self):
        return self.emergency_stop.pressed

    def state(self):
        return {"pose": [0.0, 0.0, 0.0], "velocity": None, "driven_by": "nobody", "mover": ["nobody", ""],
                "stopped": self.stopped, "stop_waits": False, "pressed_here": self.stopped, **self.told}

    def figures(self):
        return [{"name": "r1", "up": True, "age": None}], {"r1": {"link": {"level": 0}}}

    def status(self):
        return {"frame": "odom", "lights": [], "battery": None, "radius": None, "near": [], "map": None,
                "scan": [], "camera": False, "navigation": False, "goal": None, "note": {"number": 0, "words": ""},
                **self.told}


class Client(LoopClient):
    """Opens pages as a browser would; for a `with` block."""

    def page(self, **headers):
        """An open page (OpenPage), without those that are empty; raises HTTPClientError when it is refused."""
        given = {"Origin": f"http://127.0.0.1:{self.port}", **headers}
        return OpenPage(self, {name: value for name, value in given.items() if value})

    def ready_page(self, **headers):
        page = self.page(**headers)
        wait_for(lambda: {"hello", "state", "status"} <= set(page.messages), "the first messages")
        return page

    def awaited_page(self):
        """Likewise, of a server that may still start."""
        def opened():
            with contextlib.suppress(OSError):
                return self.ready_page()
        return wait_for(opened, "the page", 60.0, period=0.2)


class Served(Client):
    """The server in the same loop as its clients, for a `with` block."""

    def __init__(self, token=None, oldest=0.2, dead_man=0.3):
        super().__init__()
        self.robot = NotedRobot()
        self.access = Access(token)
        self._seat = DrivingSeat(SPEEDS, oldest, dead_man)

    def __enter__(self):
        super().__enter__()

        async def start():
            self.server = WebServer(self.robot, self._seat, self.access, ("robot.local",))
            self.server.listen("127.0.0.1", 0)
            self.port = self.server.port
        self.do(start())
        return self

    def __exit__(self, *_):
        self.do(self.server.close())
        super().__exit__()


class OpenPage:
    """What a page would be: the newest state, and messages."""

    def __init__(self, client, headers):
        self._client, self.closed = client, False
        self.messages = {}  # newest of each kind
        self.states = 0

        async def connect():
            request = HTTPRequest(f"ws://127.0.0.1:{client.port}/socket", headers=headers)
            return await websocket_connect(request, on_message_callback=self._on_message)
        self.socket = client.do(connect())

    def _on_message(self, text):
        if text is None:
            self.closed = True
            return
        message = json.loads(text)
        self.messages[message["kind"]] = message
        self.states += message["kind"] == "state"

    def send(self, *messages):
        async def write():
            for message in messages:
                text = message if isinstance(message, (str, bytes)) else json.dumps(message)
                await self.socket.write_message(text, binary=isinstance(text, bytes))
        with contextlib.suppress(Exception):  # the server may have closed it, as it should
            self._client.do(write())

    def close(self):
        self._client.loop.call_soon_threadsafe(self.socket.close)

    @property
    def time(self):
        return self.messages["state"]["time"]

    def drive(self, x=0.0, y=0.0, turn=0.0, time=None):
        self.order("drive", time, x=x, y=y, turn=turn)

    def order(self, kind, time=None, **fields):
        self.send({"kind": kind, "time": self.time if time is None else time, **fields})


def room(x=0.0, **info):
    """An empty map whose corner is at x [m]."""
    grid = OccupancyGrid(info=MapMetaData(**{"resolution": 0.5, "width": 12, "height": 12, **info}), data=[0] * 144)
    grid.info.origin.position.x, grid.info.origin.orientation.w = x, 1.0
    return grid
