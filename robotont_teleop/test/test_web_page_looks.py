"""How the page looks in a real browser, on a server whose robot only takes notes: on every screen, for everybody."""

from pathlib import Path

import pytest
from page_client import LIGHTS, choose_language, open_page, report
from page_states import STATES
from page_states import tell as tell_state

from robotont_testing.browser import CHROMIUM, DESKTOP, PHONE, PHONE_LYING, Browser
from robotont_testing.harness import tool_module
from robotont_testing.stalling_proxy import StallingProxy

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


def tell(server, trouble):
    """Let the robot tell the page all that it can show; with trouble in some lights, or none."""
    report(server, {f"node: {name}": (place % 3 * trouble, "as many words as a node says of itself, and some more")
                    for place, name in enumerate(LIGHTS)},
           {"velocity": [0.2, 0.0, 0.1]},
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
        for dark, language, more in ((False, "de", CONTROLS), (True, "et", ("#take", "#release", "#more"))):
            if dark:  # all at once: another page drives, faults, a pressed stop
                tell(served, trouble=True)
                served.ready_page().order("take")
                served.robot.emergency_stop.press()
                page.wait("['take', 'stopped', 'fault'].every((id) => !$(id).hidden)", "all bars")
            for size in sizes:
                page.look(size, dark)
                choose_language(page, language)
                page.wait(f"innerWidth === {size[0]} && document.documentElement.lang === {language!r}", "the screen")
                hidden = size[1] <= 350 or size[0] >= 900  # no room, or the details are there anyway
                check_places(page, size, [one for one in more if one != "#more" or not hidden])
                if size in (PHONE, DESKTOP):
                    check_by_axe(page)
        assert page.complaints() == []
        page.close()
        login = browser.page(f"http://127.0.0.1:{served.port}/login.html", PHONE)
        login.wait("document.querySelector('[type=submit]').textContent", "the words")
        login.run(axe())
        check_by_axe(login)


@pytest.mark.nightly
def test_nothing_stands_on_anything_else_in_any_state_and_language(served):
    with Browser() as browser:
        proxy = StallingProxy(served.port)
        page, found = open_page(browser, proxy, size=PHONE), []
        for name, told in STATES.items():
            tell_state(served, {**told, "board": name})
            page.wait(f"$('facts').textContent.includes({name!r})", name)
            if told.get("closed"):
                proxy.close()
                page.wait("$('app').dataset.state === 'lost'", "the end of the connection")
            head = ("#stop_waits",) if told.get("stop_waits") else HEAD  # over it
            for size in SIZES:
                page.look(size, False)
                page.wait(f"innerWidth === {size[0]}", "the screen")
                for language, (shown, faults), high in page.run(
                        f"{list(LANGUAGES)}.map((code) => {{ while (document.documentElement.lang !== code) "
                        f"$('language').click(); return [code, {boxes((*head, *ALWAYS, *BESIDE))}, "
                        "document.querySelector('.head').offsetHeight >= innerHeight / 4]; })"):
                    assert {"move", "turn", "stop"} <= set(shown)
                    found += [(name, size, language, faults, high)] if faults or high else []
        assert found == [], str(found)


def check_by_axe(page):
    """The rules can be applied, that of contrast among them, and none of them is violated seriously."""
    passed, violated, failed = page.run(
        "axe.run().then(({passes, violations, incomplete}) => [passes.map((rule) => rule.id), violations.map("
        "(rule) => [rule.impact, rule.id, rule.nodes.map((node) => node.target)]), "
        "incomplete.filter((rule) => rule.error).map((rule) => [rule.id, rule.message])])")
    assert failed == []
    assert "color-contrast" in passed
    assert not [rule for rule in violated if rule[0] in ("serious", "critical")]


def boxes(selectors):
    """JavaScript for [what is shown, what stands on anything else or off the screen]."""
    return f"{FAULTS}({', '.join(selectors)!r})"


def check_places(page, size, wanted):
    """Every control is on the screen and large enough for its finger; nothing stands on anything else."""
    assert page.run("document.documentElement.scrollWidth <= innerWidth && "
                    "document.documentElement.scrollHeight <= innerHeight"), "scroll bars"
    wanted = (*HEAD[:2], *ALWAYS, *wanted, *(("#reset_odometry", "#language") if size == DESKTOP else ()))
    shown, faults = page.run(boxes((*wanted, *BESIDE)))
    assert faults == [], (size, str(faults))
    assert {control[1:] for control in wanted if control[0] == "#"} <= set(shown), size
    stop, ring = page.box("#stop"), page.box("#move")
    assert min(stop[2:]) >= 88, size
    assert min(ring[2:]) >= 100, size


def axe():
    return Path(tool_module("axe_core_python").__file__).with_name("axe.min.js").read_text()
