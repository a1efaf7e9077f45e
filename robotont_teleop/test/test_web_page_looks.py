"""How the page looks in a real browser, on a server whose robot only takes notes: on every screen, for everybody."""

import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from page_client import LIGHTS, choose_language, open_page, png, report

from robotont_testing.browser import CHROMIUM, DESKTOP, PHONE, PHONE_LYING, Browser
from robotont_testing.harness import tool_module

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
LANGUAGES = ("en", "de", "et")
FAULTS = """((selector) => {  // of the elements that are shown: too wide texts, what is off the screen, what overlaps
  const shown = [...document.querySelectorAll(selector)].filter((one) => one.getClientRects()[0]?.width > 0 &&
    getComputedStyle(one).visibility === "visible");
  const name = (one) => one.id || one.getAttribute('class') || one.tagName;
  const box = (one) => one.getBoundingClientRect();
  const over = (one, other) => !one.contains(other) && !other.contains(one) &&
    box(one).left < box(other).right && box(other).left < box(one).right &&
    box(one).top < box(other).bottom && box(other).top < box(one).bottom;
  const faults = {
    wide: shown.filter((one) => one.offsetWidth > 0 && one.scrollWidth > one.clientWidth + 1).map(name),
    out: shown.filter((one) => box(one).left < 0 || box(one).right > innerWidth || box(one).top < 0 ||
      box(one).bottom > innerHeight).map(name),
    pairs: shown.flatMap((one, place) => shown.slice(place + 1).filter((other) => over(one, other)).map(
      (other) => [name(one), name(other)]))};
  return [shown.map(name), Object.entries(faults).filter(([, found]) => found.length)];
})"""
ALWAYS = ("#move", "#turn", "#stop", "#chips")
CONTROLS = ("#heading", "#whole")
BESIDE = (".message", ".readings", ".alarm", ".tools .button", ".chips .button", ".thumb", "#near text")
HEAD = ("#driver", "#can", "#charge", ".head > .dot", ".head .button")
SIZES = (PHONE, PHONE_LYING, DESKTOP, (320, 568, 2), (568, 320, 2), (360, 740, 2), (768, 1024, 1), (1920, 1080, 1))


def tell(server, trouble, **given):
    """Let the robot tell the page all that it can show; with trouble in some lights, or none."""
    report(server, {f"node: {name}": (place % 3 * trouble, "as many words as a node says of itself, and some more")
                    for place, name in enumerate(LIGHTS)},
           {"velocity": [0.2, 0.0, 0.1], **given}, camera=bool(given),
           board="robotont_firmware 2.0.0 wheels 3", battery={"voltage": 12.1, "charge": 1.0},
           near=[0.1] * 9 + [None] * 6 + [1.5] * 9)


@pytest.mark.parametrize("sizes", [SIZES[:4], pytest.param(SIZES[4:], marks=pytest.mark.nightly)], ids=["4", "others"])
def test_it_looks_right_and_everybody_can_use_it(served, sizes):
    with Browser() as browser:
        page = open_page(browser, served, size=PHONE, language="de")
        assert page.run("document.documentElement.lang") == "de", "the browser's language"
        tell(served, trouble=False)
        page.wait(f"document.querySelectorAll('#lights li').length === {len(LIGHTS)}", "the robot's health")
        page.run(axe())
        for dark, more in ((False, CONTROLS), (True, ("#take", "#release", "#more")),
                           (False, ("#swap", "#stop_waits"))):
            if "#take" in more:  # all at once: another page drives, faults, a pressed stop
                tell(served, trouble=True)
                served.ready_page().order("take")
                served.robot.emergency_stop.press()
                page.wait("['take', 'stopped', 'fault'].every((id) => !$(id).hidden)", "all bars")
            if "#swap" in more:  # a camera, and a stop that has not arrived
                served.server.seat.leave(served.server.seat.driver)
                served.robot.camera = SimpleNamespace(picture=lambda: (time.monotonic_ns(), png()))
                tell(served, trouble=True, mover=["program", "square"], stop_waits=True)
                page.wait("!$('swap').hidden && $('stop_waits').innerText.includes('square')", "camera and stop")
            for size in sizes:
                page.look(size, dark)
                page.wait(f"innerWidth === {size[0]}", "the screen")
                hidden = size[1] <= 350 or size[0] >= 900  # no room, or the details are there anyway
                for language in LANGUAGES:
                    choose_language(page, language)
                    check_places(page, (size, language), [one for one in more if one != "#more" or not hidden])
                if size in (PHONE, DESKTOP):
                    check_by_axe(page)
        assert page.complaints() == []
        page.close()
        login = browser.page(f"http://127.0.0.1:{served.port}/login.html", PHONE)
        login.wait("document.querySelector('[type=submit]').textContent", "the words")
        login.run(axe())
        check_by_axe(login)


def check_by_axe(page):
    """The rules can be applied, that of contrast among them, and none of them is violated seriously."""
    passed, violated, failed = page.run(
        "axe.run().then(({passes, violations, incomplete}) => [passes.map((rule) => rule.id), violations.map("
        "(rule) => [rule.impact, rule.id, rule.nodes.map((node) => node.target)]), "
        "incomplete.filter((rule) => rule.error).map((rule) => [rule.id, rule.message])])")
    assert failed == []
    assert "color-contrast" in passed
    assert not [rule for rule in violated if rule[0] in ("serious", "critical")]


def check_places(page, where, wanted):
    """Every control is on the screen and large enough for its finger; nothing stands on anything else."""
    assert page.run("document.documentElement.scrollWidth <= innerWidth && "
                    "document.documentElement.scrollHeight <= innerHeight"), "scroll bars"
    assert "#take" in wanted or page.run("document.querySelector('.head').offsetHeight < innerHeight / 4"), where
    head = () if "#stop_waits" in wanted else HEAD  # which stands over it
    wanted = (*head[:2], *ALWAYS, *wanted, *(("#reset_odometry", "#language") if DESKTOP in where else ()))
    shown, faults = page.run(f"{FAULTS}({', '.join((*wanted, *head[2:], *BESIDE))!r})")
    assert faults == [], (where, str(faults))
    assert {control[1:] for control in wanted if control[0] == "#"} <= set(shown), where
    stop, ring = page.box("#stop"), page.box("#move")
    assert min(stop[2:]) >= 88, where
    assert min(ring[2:]) >= 100, where


def axe():
    return Path(tool_module("axe_core_python").__file__).with_name("axe.min.js").read_text()
