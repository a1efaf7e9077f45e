#!/usr/bin/env python3
"""Draws the page for driving by hand when something is wrong: draw_page_faults.py [FOLDER]. Needs Chromium.

One picture for each screen, light and dark, with all faults side by side. The page is the real one; behind it is a
server whose robot says what the fault makes a robot say (`robotont_teleop/test/web_client.py`).
"""

import io
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "robotont_teleop" / "test"))
from web_client import Served

from robotont_testing.browser import DESKTOP, PHONE, Browser
from robotont_testing.stalling_proxy import StallingProxy

LIGHTS = {"driver_node: command stream": "following cmd_vel", "odom_node: wheel feedback": "50 packets/s",
          "odom_node: stamps": "stamps by packet number and arrival", "serial_com_node: board": "reports no fault",
          "serial_com_node: link": "50 packets/s", "cmd_vel_mux: who drives": "hand"}
OUT = "no such file or directory; is the board plugged in, and is this the right port? (/dev/robotont)"
BLOCKED = ("wheels 0 and 2 do not turn as commanded: look for a blocked wheel, a loose motor or encoder cable, "
           "an empty battery")
OPEN = "document.getElementById('app')?.dataset.state === 'open'"


class Robot:
    """What a driving robot on a map tells the page, changed by `wrong`: {name of a light: (level, words)}."""

    def __init__(self, noted):
        self.noted = noted
        noted.state, noted.status, noted.scan = self.state, self.status, self.scan
        self.wrong, self.battery, self.numbers, self.map = {}, {"voltage": 15.2, "charge": 0.8}, True, True

    def state(self):
        """As of RobotView."""
        seen = self.numbers or None
        return {"pose": seen and [1.2, 0.8, 0.6], "velocity": seen and [0.2, 0.0, 0.3],
                "limited": [0.2, 0.0, 0.3], "commanded": [-0.2, 0.0, 0.2], "measured": seen and [-0.19, 0.0, 0.2],
                "driven_by": "hand", "stopped": self.noted.stopped}

    def status(self):
        """As of RobotView."""
        lights = [{"name": name, "level": level, "words": words} for name, (level, words) in
                  {**{name: (0, words) for name, words in LIGHTS.items()}, **self.wrong}.items()]
        return {"frame": "map" if self.map else "odom", "lights": lights, "board": "robotont_firmware 2.0.0",
                "battery": self.battery, "ranges": [], "camera": False, "navigation": True, "goal": None,
                "map": {"number": 1, "width": 6.0, "height": 5.0, "origin": [-2.0, -2.0, 0.0]} if self.map else None,
                "note": {"number": 0, "words": ""}}

    def scan(self):
        """As of RobotView."""
        return {"number": int(5 * time.monotonic()), "from": [0, 0, 0], "first": -0.5, "step": 0.05,
                "ranges": [1.5] * 20} if self.numbers else None


def unplugged(robot, _page, _other, _proxy):
    """The board's cable is out."""
    robot.wrong = {"serial_com_node: link": (2, OUT), "serial_com_node: board": (1, "the port is closed"),
                   "odom_node: wheel feedback": (1, "no packets on serial_read, the odometry stands still")}
    robot.numbers = False


def stopped_by_me(_robot, page, _other, _proxy):
    """STOP."""
    page.tap("#stop")


def stopped_by_another(robot, page, other, _proxy):
    """Another page drives, and STOP is pressed."""
    taken_over(robot, page, other, _proxy)
    robot.noted.emergency_stop.press()


def stalled(_robot, _page, _other, proxy):
    """Nothing comes through."""
    proxy.stall()


def taken_over(_robot, page, other, _proxy):
    """Another page has taken over."""
    page.finger(1, "#move", up=0.5)
    page.wait("document.getElementById('driver').textContent === 'You drive'", "this page at the wheel")
    page.lift()
    other.order("take")


def blocked(robot, _page, _other, _proxy):
    """Two wheels stand."""
    robot.wrong = {"odom_node: wheel feedback": (1, BLOCKED)}


def without_map(robot, _page, _other, _proxy):
    """No map."""
    robot.map = False


def empty(robot, _page, _other, _proxy):
    """The battery is nearly empty."""
    robot.battery = {"voltage": 13.1, "charge": 0.07}


FAULTS = (unplugged, stopped_by_me, stopped_by_another, stalled, taken_over, blocked, without_map, empty)


def main():
    """Make all pictures, in docs/pictures or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent / "pictures"
    with Browser() as browser:
        for name, size, columns in (("phone", (*PHONE[:2], 1), 8), ("desktop", DESKTOP, 4)):
            for dark in (False, True):
                pictures = [take(browser, fault, size, dark) for fault in FAULTS]
                wide, high = (length if columns == 8 else length // 2 for length in size[:2])
                sheet = Image.new("RGB", (columns * (wide + 8), len(FAULTS) // columns * (high + 8)), "grey")
                for number, picture in enumerate(pictures):
                    sheet.paste(picture.resize((wide, high), Image.LANCZOS),
                                (number % columns * (wide + 8), number // columns * (high + 8)))
                path = folder / f"page_faults_{name}_{'dark' if dark else 'light'}.png"
                sheet.quantize(256, Image.Quantize.FASTOCTREE).save(path, optimize=True)


def take(browser, fault, size, dark):
    """The picture of one fault."""
    with Served(oldest=10.0, dead_man=10.0, robot="robotont-3") as served:
        robot = Robot(served.robot)
        served.robot.map_picture = room()
        proxy = StallingProxy(served.port)
        page = browser.page(f"http://127.0.0.1:{proxy.port}/", size, dark)
        page.wait(OPEN + " && document.querySelectorAll('#lights li').length > 0", "the page")
        other = served.ready_page()
        fault(robot, page, other, proxy)
        page.run("new Promise((done) => setTimeout(done, 1500))")
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            page.screenshot(file.name)
            picture = Image.open(file.name).convert("RGB")
        page.close()
        proxy.close()
        return picture


def room():
    """A room of 6 x 5 m, as a PNG of RobotView."""
    from robotont_teleop.web.page_pictures import FREE, OCCUPIED, UNKNOWN
    picture = Image.new("LA", (120, 100), UNKNOWN)
    picture.paste(OCCUPIED, (10, 10, 110, 90))
    picture.paste(FREE, (12, 12, 108, 88))
    output = io.BytesIO()
    picture.save(output, "PNG")
    return output.getvalue()


if __name__ == "__main__":
    main()
