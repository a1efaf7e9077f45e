"""The page in a real browser for its tests: opened, told what to show, and asked for what it shows."""

import io

from PIL import Image

from robotont_teleop.hand.fault_keys import fault_key
from robotont_teleop.hand.robot_reports import worst_first
from robotont_teleop.hand.speeds import STOP
from robotont_testing.browser import DESKTOP

FIND = "window.$ = (id) => document.getElementById(id);"
OPEN = "$('app')?.dataset.state === 'open'"  # not yet on the login page
LINK, WHEELS = "serial_com_node: link", "odom_node: wheel feedback"
LIGHTS = ["black box", "board", "command stream", "gamepad", "guard", "gyro", "link", "localization", "real time",
          "stamps", "web page", "wheel feedback", "who drives"]  # of all nodes of the stack: `Health`


def open_page(browser, server, place="", size=DESKTOP, script="", **options):
    """A page that is connected, in English unless `language` says another one."""
    browser.call("Storage.clearCookies")
    page = browser.page(f"http://127.0.0.1:{server.port}/{place}", size, script=FIND + script, **options)
    page.wait(OPEN, "the connection")
    return page


def report(server, lights=None, given=None, **status):
    """Let the robot tell the page `lights`, {name: (level, words)}, and what else is given."""
    lights = worst_first(
        {"name": name, "level": level, "words": words, "key": "silent" if level == 3 else fault_key(name, words)}
        for name, (level, words) in (lights or {LINK: (0, "50 packets/s")}).items())
    server.robot.told = {"lights": lights, **(given or {}), **status}


def drives(server):
    """Whether the newest command asks for motion."""
    return bool(server.robot.sent) and server.robot.sent[-1] != STOP


def press_mouse(page, selector):
    """A click."""
    x, y = page.place(selector)
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)


def png(width=80):
    """A picture."""
    file = io.BytesIO()
    Image.new("L", (width, 40)).save(file, "PNG")
    return file.getvalue()
