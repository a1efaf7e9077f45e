"""How the page looks in a real browser, on a server whose robot only takes notes: on every screen, for everybody."""

import itertools
import json
from pathlib import Path

import pytest
from test_web_page import LIGHTS, choose_language, open_page, report

from robotont_testing.browser import CHROMIUM, DESKTOP, PHONE, PHONE_LYING, Browser
from robotont_testing.harness import tool_module

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
NARROW = ((360, 740, 2), (390, 844, 2))  # phones
LANGUAGES = ("en", "de", "et")
WHO = ("who_navigation", "who_other", "who_others", "who_you", "who_nobody", "lost")
FAULTS = """((selector) => {  // of the elements that are shown: too wide texts, what is off the screen, what overlaps
  const shown = [...document.querySelectorAll(selector)].filter((one) => one.offsetWidth > 0);
  const name = (one) => one.id || one.className;
  const box = (one) => one.getBoundingClientRect();
  const over = (one, other) => !one.contains(other) && !other.contains(one) &&
    box(one).left < box(other).right && box(other).left < box(one).right &&
    box(one).top < box(other).bottom && box(other).top < box(one).bottom;
  const faults = {
    wide: shown.filter((one) => one.scrollWidth > one.clientWidth + 1).map(name),
    out: shown.filter((one) => box(one).left < 0 || box(one).right > innerWidth || box(one).top < 0 ||
      box(one).bottom > innerHeight).map(name),
    pairs: shown.flatMap((one, place) => shown.slice(place + 1).filter((other) => over(one, other)).map(
      (other) => [name(one), name(other)]))};
  return [shown.map(name), Object.entries(faults).filter(([, found]) => found.length)];
})"""
SAY = """(async ([who, button]) => {
  const {text} = await import('/texts.js');
  $('driver').textContent = text(who);
  $('round_trip').textContent = '1234 ms';
  for (const id of ['take', 'give_back']) {
    $(id).hidden = id !== button;
  }
})"""
ALWAYS = ("#move", "#turn", "#stop", "#chips", "#driver", "#can", "#round_trip")
CONTROLS = ("#closer", "#farther")
BESIDE = ("#scale", ".message", ".readings", ".alarm", ".tools .button", ".chips .button")  # where they are shown
SIZES = (PHONE, PHONE_LYING, DESKTOP, (320, 568, 2), (568, 320, 2), (360, 740, 2), (768, 1024, 1), (1920, 1080, 1))


def tell(server, trouble):
    """Let the robot tell the page all that it can show; with trouble in some lights, or none."""
    report(server, {f"node: {name}": (place % 3 * trouble, "as many words as a node says of itself, and some more")
                    for place, name in enumerate(LIGHTS)},
           {"velocity": [0.2, 0.0, 0.1], "commanded": [0.1, 0.2, 0.3], "measured": [0.1, 0.1, 0.1]},
           board="robotont_firmware 2.0.0 wheels 3", battery={"voltage": 12.1, "charge": 1.0}, near=[0.1] * 9 + [None] * 6 + [1.5] * 9)


def test_it_looks_right_and_everybody_can_use_it(served):
    with Browser() as browser:
        page = open_page(browser, served, size=PHONE, language="de")
        assert page.run("document.documentElement.lang") == "de", "the browser's language"
        tell(served, trouble=False)
        page.wait(f"document.querySelectorAll('#lights li').length === {len(LIGHTS)}", "the robot's health")
        check_header(page)
        page.run(axe())
        for dark, language, more in ((False, "de", CONTROLS), (True, "et", ("#take", "#release", "#more"))):
            if dark:  # all at once: another page drives, faults, a pressed stop
                tell(served, trouble=True)
                served.ready_page().order("take")
                served.robot.emergency_stop.press()
                page.wait("['take', 'stopped', 'fault'].every((id) => !$(id).hidden)", "all bars")
            for size in SIZES:
                page.look(size, dark)
                choose_language(page, language)
                page.wait(f"innerWidth === {size[0]} && document.documentElement.lang === {language!r}", "the screen")
                check_places(page, size, [one for one in more if one != "#more" or size[1] > 350])
                if size in (PHONE, DESKTOP):
                    check_by_axe(page)
                if size == PHONE:
                    page.tap("#details")
                    check_by_axe(page)
                    page.tap("#details")
        assert page.complaints() == []
        login = browser.page(f"http://127.0.0.1:{served.port}/login.html", PHONE)
        login.run(axe())
        check_by_axe(login)


def check_header(page):
    """On narrow phones, whoever drives, with the battery and either button."""
    page.wait("$('battery').offsetWidth > 0", "the battery")
    for size, language in itertools.product(NARROW, LANGUAGES):
        page.look(size, False)
        choose_language(page, language)
        page.wait(f"innerWidth === {size[0]} && document.documentElement.lang === {language!r}", "the screen")
        for who, button in itertools.product(WHO, ("take", "give_back", "")):
            shown, faults = page.run(  # at once, before the next status is shown
                f"{SAY}({json.dumps([who, button])}).then(() => "
                f"{FAULTS}('.head, .head :is(#driver, #charge, #round_trip, .dot, .button, .fact)'))")
            assert {"driver", "charge", "round_trip", *filter(None, [button])} <= set(shown)
            assert faults == [], (size, language, who, button)
            assert page.box(".head")[3] < size[1] / 4


def check_by_axe(page):
    """The rules can be applied, that of contrast among them, and none of them is violated seriously."""
    passed, violated, failed = page.run(
        "axe.run().then(({passes, violations, incomplete}) => [passes.map((rule) => rule.id), violations.map("
        "(rule) => [rule.impact, rule.id, rule.nodes.map((node) => node.target)]), "
        "incomplete.filter((rule) => rule.error).map((rule) => [rule.id, rule.message])])")
    assert failed == []
    assert "color-contrast" in passed
    assert not [rule for rule in violated if rule[0] in ("serious", "critical")]


def check_places(page, size, wanted):
    """Every control is on the screen and large enough for its finger; nothing stands on anything else."""
    page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")  # it has been drawn
    assert page.run("document.documentElement.scrollWidth <= innerWidth && "
                    "document.documentElement.scrollHeight <= innerHeight"), "scroll bars"
    wanted = (*ALWAYS, *wanted, *(("#reset_odometry", "#language") if size == DESKTOP else ()))
    shown, faults = page.run(f"{FAULTS}({', '.join((*wanted, *BESIDE))!r})")
    assert {control[1:] for control in wanted if control[0] == "#"} <= set(shown), size
    assert faults == [], size
    stop, ring = page.box("#stop"), page.box("#move")
    assert min(stop[2:]) >= 88, size
    assert min(ring[2:]) >= 100, size


def axe():
    return Path(tool_module("axe_core_python").__file__).with_name("axe.min.js").read_text()
