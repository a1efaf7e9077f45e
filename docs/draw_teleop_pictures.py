#!/usr/bin/env python3
"""Draws the pictures of the page for driving by hand, in twelve states: draw_teleop_pictures.py [FOLDER].

Needs Chromium. The robot is the one of the page's tests, which tells whatever it is told.
"""

import sys
import time
from pathlib import Path

from PIL import Image

from robotont_testing.browser import DESKTOP, Browser
from robotont_testing.stalling_proxy import StallingProxy

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "robotont_teleop" / "test"))
from page_states import STATES, tell  # noqa: E402
from web_client import PATIENCE, Served  # noqa: E402

SCREENS = (("phone", (390, 844, 2)), ("lying", (844, 390, 2)), ("desktop", DESKTOP))
HEIGHT = {"phone": 640, "lying": 290, "desktop": 420}  # [px] of a state on the sheet, and how many stand in a row
IN_FULL = {("phone", False), ("desktop", False)}
IN_A_ROW = {"phone": 6, "lying": 3, "desktop": 3}


def main():
    """Make all pictures, in docs/pictures or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    taken = {}
    with Browser() as browser:
        for name, told in STATES.items():
            with Served(oldest=PATIENCE, dead_man=PATIENCE) as server:
                taken.update({(name, *which): picture for which, picture in pictures(browser, server, told)})
    for (screen, _), dark in ((one, dark) for one in SCREENS for dark in (False, True)):
        theme = "dark" if dark else "light"
        sheet([taken[name, screen, dark] for name in STATES], HEIGHT[screen], IN_A_ROW[screen]).save(
            folder / f"page_states_{screen}_{theme}.png", optimize=True)
        if (screen, dark) in IN_FULL:
            taken["you", screen, dark].save(folder / f"teleop_{screen}_{theme}.png", optimize=True)


def pictures(browser, server, told):
    """((screen, dark), picture) of each."""
    proxy = StallingProxy(server.port)
    page = browser.page(f"http://127.0.0.1:{proxy.port}/", SCREENS[0][1])
    tell(server, told)
    page.wait("document.querySelectorAll('#lights li').length > 1", "the robot's health")
    page.wait("performance.getEntriesByType('resource').some(({name}) => name.includes('map.png'))", "the map")
    if told.get("closed"):
        proxy.close()
        page.wait("document.getElementById('app').dataset.state === 'lost'", "the end of the connection")
    for screen, size in SCREENS:
        for dark in (False, True):
            page.look(size, dark)
            if told.get("thumb"):
                page.push(1, "#move", 0.25, 0.6)
            page.run("new Promise((done) => setTimeout(done, 700))")
            path = Path("/tmp") / f"page_{time.monotonic_ns()}.png"
            page.screenshot(path)
            page.lift()
            yield (screen, dark), Image.open(path).convert("RGB")
            path.unlink()
    page.close()
    proxy.close()


def sheet(pictures, height, in_a_row):
    """All states as one picture."""
    small = [one.resize((round(one.width * height / one.height), height)) for one in pictures]
    width, gap, rows = small[0].width, 12, -(-len(small) // in_a_row)
    whole = Image.new("RGB", (in_a_row * (width + gap) - gap, rows * (height + gap) - gap), "#808890")
    for place, one in enumerate(small):
        whole.paste(one, (place % in_a_row * (width + gap), place // in_a_row * (height + gap)))
    return whole.quantize(256, Image.FASTOCTREE)


if __name__ == "__main__":
    main()
