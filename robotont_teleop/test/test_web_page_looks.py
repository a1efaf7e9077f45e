"""How the page looks in a real browser, on a server whose robot only takes notes: phone and laptop, for everybody."""

import time
from pathlib import Path
from types import SimpleNamespace

from page_client import LIGHTS, open_page, png, report

from robotont_testing.browser import DESKTOP, PHONE
from robotont_testing.harness import tool_module

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
BESIDE = (".message", ".readings", ".alarm", ".tools .button", ".chips .button", ".thumb", "#near text")
HEAD = ("#driver", "#can", "#charge", ".head > .dot", ".head .button")


def tell(server, trouble, **given):
    """Let the robot tell the page all that it can show; with trouble in some lights, or none."""
    report(server, {f"node: {name}": (place % 3 * trouble, "as many words as a node says of itself, and some more")
                    for place, name in enumerate(LIGHTS)},
           {"velocity": [0.2, 0.0, 0.1], **given}, camera=bool(given),
           battery={"voltage": 12.1, "charge": 1.0}, near=[0.1] * 9 + [None] * 6 + [1.5] * 9)


def test_it_looks_right_and_everybody_can_use_it(browser, served):
    page = open_page(browser, served, size=PHONE, language="de")
    assert page.run("document.documentElement.lang") == "de", "the browser's language"
    tell(served, trouble=False)
    page.wait(f"document.querySelectorAll('#lights li').length === {len(LIGHTS)}", "the robot's health")
    check_screens(page, *HEAD, "#heading", "#whole")
    tell(served, trouble=True)
    served.ready_page().order("take")
    served.robot.emergency_stop.press()
    page.wait("['take', 'stopped', 'fault'].every((id) => !$(id).hidden)", "all bars")
    check_screens(page, *HEAD, "#take", "#release", dark=True)
    served.server.seat.leave(served.server.seat.driver)
    served.robot.camera = SimpleNamespace(picture=lambda: (time.monotonic_ns(), png()))
    tell(served, trouble=True, mover=["program", "square"], stop_waits=True)
    page.wait("!$('swap').hidden && $('stop_waits').innerText.includes('square')", "camera and stop")
    check_screens(page, "#swap", "#stop_waits")  # which stands over the head
    assert page.complaints() == []
    page.close()
    login = browser.page(f"http://127.0.0.1:{served.port}/login.html", PHONE)
    login.wait("document.querySelector('[type=submit]').textContent", "the words")
    check_by_axe(login)
    login.close()


def check_screens(page, *wanted, dark=False):
    """In each language controls are on the screen, large enough for a finger, and nothing stands on anything else."""
    for size in (PHONE, DESKTOP):
        page.look(size, dark)
        page.wait(f"innerWidth === {size[0]}", "the screen")
        controls = *ALWAYS, *wanted, *(("#reset_odometry", "#language") if size == DESKTOP else ())
        for language in ("en", "de", "et"):
            page.run(f"while (document.documentElement.lang !== '{language}') $('language').click()")
            shown, faults = page.run(f"{FAULTS}({', '.join((*controls, *BESIDE))!r})")
            assert faults == [], (size, language, str(faults))
            assert {one[1:] for one in controls if one[0] == "#"} <= set(shown), (size, language)
        assert page.run("document.documentElement.scrollWidth <= innerWidth && "
                        "document.documentElement.scrollHeight <= innerHeight"), "scroll bars"
        assert min(page.box("#stop")[2:]) >= 88, size
        assert min(page.box("#move")[2:]) >= 100, size
        check_by_axe(page)


def check_by_axe(page):
    """The rules can be applied, that of contrast among them, and none of them is violated seriously."""
    page.run(Path(tool_module("axe_core_python").__file__).with_name("axe.min.js").read_text())
    passed, violated, failed = page.run(
        "axe.run().then(({passes, violations, incomplete}) => [passes.map((rule) => rule.id), violations.map("
        "(rule) => [rule.impact, rule.id, rule.nodes.map((node) => node.target)]), "
        "incomplete.filter((rule) => rule.error).map((rule) => [rule.id, rule.message])])")
    assert failed == []
    assert "color-contrast" in passed
    assert not [rule for rule in violated if rule[0] in ("serious", "critical")]
