"""The page in a real browser, on a server whose robot only takes notes."""

import re

import pytest
from web_client import TOKEN

from robotont_teleop.speeds import STOP
from robotont_testing.browser import CHROMIUM, DESKTOP, Browser
from robotont_testing.harness import wait_for

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
OPEN = "document.getElementById('app')?.dataset.state === 'open'"  # not yet on the login page


@pytest.fixture(scope="module")
def browser():
    with Browser() as one:
        yield one


@pytest.fixture
def page(browser, served):
    opened = open_page(browser, served)
    yield opened
    assert opened.complaints() == []
    opened.close()


def open_page(browser, server, place="", size=DESKTOP, **options):
    page = browser.page(f"http://127.0.0.1:{server.port}/{place}", size, **options)
    page.wait(OPEN, "the connection")
    return page


def key_event(page, kind, code, modifier="", element="body"):
    """A key that the system's own shortcuts would swallow here; `modifier`: such as metaKey."""
    page.run(f"document.querySelector({element!r}).dispatchEvent(new KeyboardEvent({kind!r}, {{code: {code!r}, "
             f"bubbles: true, cancelable: true, {modifier and modifier + ': true'}}})) && 0")


def press_mouse(page, selector, right=0.0, button="left"):
    x, y = page.place(selector, right)
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1)


def focus(page):
    """The element that has the keys, as its id; empty: none has."""
    return page.run("document.activeElement.id")


def drives(server):
    return bool(server.robot.sent) and server.robot.sent[-1] != STOP


def drive_by_key(page, server):
    page.key("KeyW", down=True)
    wait_for(lambda: drives(server), "motion")


SWALLOWERS = (
    ("Cmd", lambda page: key_event(page, "keydown", "MetaLeft", "metaKey")),
    ("the end of Cmd", lambda page: key_event(page, "keyup", "MetaLeft")),
    ("losing the focus", lambda page: page.run("window.dispatchEvent(new Event('blur')) && 0")),
    ("Ctrl and a key", lambda page: key_event(page, "keydown", "KeyT", "ctrlKey")),
    ("Alt", lambda page: key_event(page, "keydown", "AltLeft", "altKey")),
    ("a context menu by the mouse", lambda page: press_mouse(page, "#view", button="right")),
    ("a context menu by a key", lambda page: page.run(
        "document.body.dispatchEvent(new MouseEvent('contextmenu', {bubbles: true, cancelable: true})) && 0")),
    ("the list", lambda page: page.run("document.getElementById('language').focus()")))


def test_whatever_may_swallow_the_end_of_a_key_stops(page, served):
    for what, act in SWALLOWERS:
        drive_by_key(page, served)
        act(page)
        wait_for(lambda: not drives(served), f"the stop after {what}")
        page.run("new Promise((done) => setTimeout(done, 100))")
        assert not drives(served), what
        page.key("KeyW", down=False)
        page.run("document.activeElement.blur()")
    drive_by_key(page, served)


def test_a_thumb_that_rests_on_its_stick_drives_on_until_it_is_cancelled(page, served):
    """Android reports a long press as a request for the context menu; the stick refuses it, so that none opens."""
    page.finger(1, "#move", up=0.5)
    wait_for(lambda: drives(served), "motion")
    assert not page.run("document.getElementById('move').dispatchEvent(new MouseEvent('contextmenu', "
                        "{bubbles: true, cancelable: true}))")
    page.run("new Promise((done) => setTimeout(done, 300))")
    assert drives(served)
    page.cancel_fingers()
    wait_for(lambda: not drives(served), "the stop")


def test_after_the_mouse_the_slider_leaves_the_keys_to_the_robot(page, served):
    press_mouse(page, "#cap", 0.4)
    assert page.run("document.getElementById('cap').value") == "80"
    page.wait("document.activeElement === document.body", "the end of the slider's focus")
    for key, axis in (("KeyW", 0), ("ArrowUp", 0), ("KeyA", 1), ("KeyQ", 2)):
        page.key(key, down=True)
        wait_for(lambda axis=axis: drives(served) and served.robot.sent[-1][axis] > 0, f"motion by {key}")
        page.key(key, down=False)
        wait_for(lambda: not drives(served), "the stop")


def test_the_keyboard_reaches_the_slider_and_letters_drive_meanwhile(page, served):
    page.run("document.getElementById('cap').focus()")
    type_key(page, "ArrowLeft", 37)
    wait_for(lambda: page.text("#cap_value") == "40", "the slider's step")
    assert focus(page) == "cap"
    assert not drives(served)
    drive_by_key(page, served)


def test_the_keyboard_reaches_the_list(page, served):
    type_key(page, "Tab", 9)
    for _ in range(20):
        if focus(page) == "language":
            break
        type_key(page, "Tab", 9)
    type_key(page, "ArrowDown", 40)
    page.wait("document.documentElement.lang === 'de'", "the next language")
    assert focus(page) == "language"
    type_key(page, "KeyE", 69, "e")  # chooses by the first letter, and does not turn the robot
    page.wait("document.documentElement.lang !== 'de'", "the language of that letter")
    assert not drives(served)
    page.run("localStorage.clear()")


def test_after_the_mouse_the_list_leaves_the_keys_to_the_robot(page, served):
    press_mouse(page, "#language")  # opens it; to choose in it is the system's own window
    assert focus(page) == "language"
    page.run("document.getElementById('language').dispatchEvent(new Event('change', {bubbles: true}))")
    page.wait("document.activeElement === document.body", "the end of the list's focus")
    drive_by_key(page, served)
    page.run("localStorage.clear()")


@pytest.mark.parametrize("element", ["cap", "language", "stop"])
def test_the_space_bar_stops_whatever_has_the_focus(page, served, element):
    page.run(f"document.getElementById({element!r}).focus()")
    type_key(page, "Space", 32, " ")
    wait_for(lambda: ("press",) in served.robot.orders, "the emergency stop")


def test_the_token_leaves_the_address_each_time_the_code_is_scanned(browser, guarded):
    for _ in range(2):  # the login page has it first, then the page itself
        page = open_page(browser, guarded, f"#token={TOKEN}")
        assert page.run("location.href") == f"http://127.0.0.1:{guarded.port}/"
        page.run(f"location.hash = 'token={TOKEN}' && 0")  # a code that opens in the same tab
        page.wait("!location.href.includes('token')", "the address without the token")
        page.close()


@pytest.mark.parametrize("dark", [False, True])
def test_rims_and_borders_can_be_seen(page, dark):
    """WCAG 1.4.11: 3:1 against what they enclose and against the page around."""
    page.look(DESKTOP, dark)
    page.wait(f"matchMedia('(prefers-color-scheme: dark)').matches === {str(dark).lower()}", "the colours")
    controls = page.run("""[...document.querySelectorAll('.stick, .button')].filter(
        (one) => one.offsetWidth).map((one) => {
        const {borderTopColor, borderTopWidth, backgroundColor} = getComputedStyle(one);
        return [one.id, borderTopWidth, borderTopColor, backgroundColor]})""")
    around = page.run("['.head', 'body'].map((one) => getComputedStyle(document.querySelector(one)).backgroundColor)")
    assert {"move", "turn", "closer", "reset_odometry", "language"} <= {control[0] for control in controls}
    for name, width, border, inside in controls:
        assert width != "0px"
        assert min(contrast(border, colour) for colour in [inside, *around]) >= 3.0, (name, border, inside, around)


def test_numbers_say_what_they_are(page):
    for language, words in (("en", "Round trip"), ("de", "Hin und zurück"), ("et", "Edasi-tagasi")):
        page.run(f"document.getElementById('language').value = '{language}'; "
                 "document.getElementById('language').dispatchEvent(new Event('change'))")
        title, text = page.run("(({title, textContent}) => [title, textContent])("
                               "document.getElementById('round_trip').parentElement)")
        assert title.startswith(words)
        assert text.startswith(words)
    page.run("localStorage.clear()")


def test_a_browser_that_shows_no_gamepads_over_http(browser, served):
    page = open_page(browser, served, script="delete Navigator.prototype.getGamepads;")
    page.run("document.dispatchEvent(new Event('visibilitychange')) && 0")
    assert page.complaints() == []
    page.close()


def contrast(one, other):
    """Of two colours such as rgb(1, 2, 3), by WCAG."""
    low, high = sorted(map(luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour):
    parts = [int(part) / 255 for part in re.findall(r"\d+", colour)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def type_key(page, code, number, text=""):
    """A key with all that browsers need to act on it themselves."""
    key = text or code
    kind = "keyDown" if text else "rawKeyDown"
    page.call("Input.dispatchKeyEvent", type=kind, code=code, key=key, windowsVirtualKeyCode=number, text=text)
    page.call("Input.dispatchKeyEvent", type="keyUp", code=code, key=key, windowsVirtualKeyCode=number)
