"""The page in a real browser, on a server whose robot only takes notes."""

import contextlib
import io
import math
from types import SimpleNamespace

import pytest
from PIL import Image
from web_client import TOKEN

from robotont_teleop.hand.fault_keys import fault_key
from robotont_teleop.hand.speeds import STOP
from robotont_testing.browser import CHROMIUM, DESKTOP, PHONE, PHONE_LYING, Browser
from robotont_testing.harness import wait_for
from robotont_testing.stalling_proxy import StallingProxy

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium")
FAST = "#chips button:last-child"
FIND = "window.$ = (id) => document.getElementById(id);"
NO_FOCUS = "document.activeElement === document.body"
OPEN = "$('app')?.dataset.state === 'open'"  # not yet on the login page


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


def open_page(browser, server, place="", size=DESKTOP, script="", **options):
    page = browser.page(f"http://127.0.0.1:{server.port}/{place}", size, script=FIND + script, **options)
    page.wait(OPEN, "the connection")
    return page


def key_event(page, kind, code, modifier=""):
    """A key that the system's own shortcuts would swallow here; `modifier`: such as metaKey."""
    page.run(f"document.body.dispatchEvent(new KeyboardEvent({kind!r}, {{code: {code!r}, bubbles: true, "
             f"cancelable: true, {modifier and modifier + ': true'}}})) && 0")


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
    """As a person does it: whoever sees that a stall has taken the key lets go of it and presses it again."""
    def press():
        page.key("KeyW", down=False)
        page.key("KeyW", down=True)
        with contextlib.suppress(AssertionError):
            return wait_for(lambda: drives(server), "motion", 1.0)
    wait_for(press, "motion")


SWALLOWERS = (
    ("Cmd", lambda page: key_event(page, "keydown", "MetaLeft", "metaKey")),
    ("the end of Cmd", lambda page: key_event(page, "keyup", "MetaLeft")),
    ("losing the focus", lambda page: page.run("window.dispatchEvent(new Event('blur')) && 0")),
    ("Ctrl and a key", lambda page: key_event(page, "keydown", "KeyT", "ctrlKey")),
    ("Alt", lambda page: key_event(page, "keydown", "AltLeft", "altKey")),
    ("a context menu by the mouse", lambda page: press_mouse(page, "#view", button="right")),
    ("a context menu by a key", lambda page: page.run(
        "document.body.dispatchEvent(new MouseEvent('contextmenu', {bubbles: true, cancelable: true})) && 0")),
    ("the list", lambda page: page.run("$('language').focus()")))


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
    page.push_until(lambda: drives(served), "motion", "#move", up=0.9)
    assert not page.run("$('move').dispatchEvent(new MouseEvent('contextmenu', "
                        "{bubbles: true, cancelable: true}))")
    page.run("new Promise((done) => setTimeout(done, 300))")
    assert drives(served)
    page.cancel_fingers()
    wait_for(lambda: not drives(served), "the stop")


def test_after_the_mouse_the_list_and_the_speeds_leave_the_keys_to_the_robot(page, served):
    press_mouse(page, "#language")  # opens it; to choose in it is the system's own window
    assert focus(page) == "language"
    page.run("$('language').dispatchEvent(new Event('change', {bubbles: true}))")
    page.wait(NO_FOCUS, "the end of the list's focus")
    press_mouse(page, FAST)
    assert pressed_speed(page) == "Fast 0.50"
    page.wait(NO_FOCUS, "the end of the button's focus")
    for key, axis in (("KeyW", 0), ("ArrowUp", 0), ("KeyA", 1), ("KeyQ", 2)):
        page.key(key, down=True)
        wait_for(lambda axis=axis: drives(served) and served.robot.sent[-1][axis] > 0, f"motion by {key}")
        page.key(key, down=False)
        wait_for(lambda: not drives(served), "the stop")
    page.run("localStorage.clear()")


def test_the_keyboard_reaches_the_speeds_and_the_list(page, served):
    for number, speed in ((1, "Slow 0.15"), (3, "Fast 0.50"), (2, "Normal 0.30")):
        type_key(page, f"Digit{number}", 48 + number, str(number))
        wait_for(lambda speed=speed: pressed_speed(page) == speed, speed)
    for _ in range(20):
        type_key(page, "Tab", 9)
        if focus(page) == "language":
            break
    type_key(page, "ArrowDown", 40)
    page.wait("document.documentElement.lang === 'de'", "the next language")
    type_key(page, "KeyE", 69, "e")  # chooses by the first letter, and does not turn the robot
    page.wait("document.documentElement.lang !== 'de'", "the language of that letter")
    assert focus(page) == "language"
    assert not drives(served)
    page.run("localStorage.clear()")
    page.run("document.querySelector('#chips button').focus()")  # letters drive beside it
    drive_by_key(page, served)


def pressed_speed(page):
    return page.run("document.querySelector('#chips [aria-pressed=true]').innerText")


def test_the_speeds_are_those_of_the_buttons(page, served):
    for number, speed in ((1, 0.15), (2, 0.3), (3, 0.5)):
        type_key(page, f"Digit{number}", 48 + number, str(number))
        drive_by_key(page, served)
        wait_for(lambda speed=speed: abs(served.robot.sent[-1][0] - speed) < 1e-6, f"{speed} m/s")
        page.key("KeyW", down=False)
        wait_for(lambda: not drives(served), "the stop")


@pytest.mark.parametrize("element", ["details", "language", "stop"])
def test_the_space_bar_stops_whatever_has_the_focus(page, served, element):
    page.run(f"$({element!r}).focus()")
    type_key(page, "Space", 32, " ")
    wait_for(lambda: ("press",) in served.robot.orders, "the emergency stop")


def test_the_token_leaves_the_address_each_time_the_code_is_scanned(browser, guarded):
    for _ in range(2):  # the login page has it first, then the page itself
        page = open_page(browser, guarded, f"#token={TOKEN}")
        assert page.run("location.href") == f"http://127.0.0.1:{guarded.port}/"
        page.run(f"location.hash = 'token={TOKEN}' && 0")  # a code that opens in the same tab
        page.wait("!location.href.includes('token')", "the address without the token")
        page.close()


def test_a_browser_that_shows_no_gamepads_over_http(browser, served):
    page = open_page(browser, served, script="delete Navigator.prototype.getGamepads;")
    page.run("document.dispatchEvent(new Event('visibilitychange', {bubbles: true})) && 0")
    assert page.complaints() == []
    page.close()


def type_key(page, code, number, text=""):
    """A key with all that browsers need to act on it themselves."""
    key = text or code
    kind = "keyDown" if text else "rawKeyDown"
    page.call("Input.dispatchKeyEvent", type=kind, code=code, key=key, windowsVirtualKeyCode=number, text=text)
    page.call("Input.dispatchKeyEvent", type="keyUp", code=code, key=key, windowsVirtualKeyCode=number)


LINK, WHEELS = "serial_com_node: link", "odom_node: wheel feedback"


def report(server, lights=(), given=None, **status):
    """Let the robot tell the page `lights`, {name: (level, words)}, and what else is given."""
    robot, lights = server.robot, dict(lights or {LINK: (0, "50 packets/s")})
    state, status = {**type(robot).state(robot), **(given or {})}, {**type(robot).status(robot), **status}
    robot.state = lambda: {**state, "stopped": robot.stopped or bool((given or {}).get("stopped"))}
    robot.status = lambda: {**status, "lights": [
        {"name": name, "level": level, "words": words, "key": "silent" if level == 3 else fault_key(name, words)}
        for name, (level, words) in lights.items()]}


def level(page):
    return page.run("$('dot').dataset.level")


def choose_language(page, language):
    page.run(f"(() => {{const list = $('language'); list.value = '{language}'; "
             "list.dispatchEvent(new Event('change'))})()")


ME, PROGRAM = {"mover": ["page", ""], "driven_by": "hand"}, {"mover": ["program", "square"], "driven_by": "nobody"}
HEADS = {  # what the robot reports: who drives, what a stick does, whether it lives
    "nobody": ({}, ("Nobody drives", "Push a stick to drive", True)),
    "a program, straight on cmd_vel": (PROGRAM, ("Program: square", "Careful: a stick adds to it", True)),
    "a program, through the mux": ({**PROGRAM, "driven_by": "default"},
                                   ("Program: square", "A stick takes it over", True)),
    "navigation": ({"mover": ["navigation", "move_base"]}, ("Navigation drives", "A stick takes it over", True)),
    "keys": ({"mover": ["hand", "keyboard_teleop_1"]}, ("Keys drive", "Push a stick to drive", True)),
    "no mux": ({"heard": False}, ("Nobody drives", "No cmd_vel_mux: sticks are off", False)),
    "a stop that has not arrived": ({"stopped": True, "stop_waits": True},
                                    ("Emergency stop", "Sticks wait for the release", False)),
}


@pytest.mark.parametrize("case", HEADS)
def test_the_head_says_who_moves_the_robot_and_what_a_stick_does(page, served, case):
    told, (who, can, live) = HEADS[case]
    report(served, given=told)
    page.wait(f"$('driver').innerText === {who!r} && $('can').innerText === {can!r}", "the head")
    assert page.run("$('stop_waits').offsetWidth === innerWidth") == told.get("stop_waits", False)
    page.push(1, "#move", up=0.9)
    page.run("new Promise((done) => setTimeout(done, 150))")
    assert drives(served) == page.run("document.querySelector('.held') !== null") == live
    page.lift()


def test_a_program_drives_although_this_page_has_the_seat(page, served):
    drive_by_key(page, served)
    page.key("KeyW", down=False)
    report(served, given=ME)
    page.wait("$('driver').innerText === 'You drive'", "the page")
    report(served, given=PROGRAM)
    page.wait("$('driver').innerText === 'Program: square'", "the program")


def test_without_its_board_sticks_are_still_and_a_finger_has_to_come_anew(page, served):
    report(served)
    page.push_until(lambda: drives(served), "motion", "#move", up=0.9)
    report(served, {LINK: (2, "/dev/x: no such file")})
    page.wait("$('can').innerText === 'No board: sticks are off'", "why not")
    wait_for(lambda: not drives(served), "the stop")
    report(served)
    page.wait("$('can').innerText === 'Let go of the sticks once'", "the request")
    page.push(1, "#move", up=0.5)
    page.run("new Promise((done) => setTimeout(done, 150))")
    assert not drives(served)
    page.lift()
    page.push_until(lambda: drives(served), "motion", "#move", up=0.9)


@pytest.mark.parametrize("fault, words", [
    ({LINK: (2, "/dev/x: no such file"), WHEELS: (1, "no packets")},
     "Link to the board The board's cable is out, or the board is off"),
    ({LINK: (0, ""), WHEELS: (1, "wheel 2 stands")}, "Wheels A wheel does not turn as told: is it blocked?"),
    ({LINK: (3, "50 packets/s")}, "Link to the board Silent for 5 s: has it ended?"),
    ({"other: thing": (2, "it burns")}, "thing it burns"),
])
def test_the_worst_fault_stands_where_one_looks(page, served, fault, words):
    report(served, fault)
    page.wait(f"document.querySelector('#fault p').innerText === {words!r}", "the bar")
    assert level(page) == str(max(found for found, _ in fault.values()))
    report(served)
    page.wait("$('fault').hidden", "its end")
    assert level(page) == "0"
    assert page.text("#summary") == "All is well (1)"


@pytest.mark.parametrize("task, words, remedies", [
    ("who drives", "default must stop once after the emergency stop before driving; or call /cmd_vel_mux/give_back",
     ("end the program", "Programm beenden", "lõpeta programm")),
    ("who drives", "/square also on cmd_vel: commands may mix; use cmd_vel/default",
     ("use cmd_vel/default", "cmd_vel/default nehmen", "kasutagu see cmd_vel/default")),
    ("guard", "in the way: something on the left, 0.08 m from the robot",
     ("in the way: 0.08 m", "Etwas ist im Weg: 0.08 m", "Midagi on ees: 0.08 m"))])
def test_who_cannot_drive_is_told_why_in_each_language(page, served, task, words, remedies):
    report(served, {f"cmd_vel_mux: {task}": (1, words)})
    for language, remedy in zip(("en", "de", "et"), remedies):
        choose_language(page, language)
        page.wait(f"$('fault_words').innerText.includes({remedy!r})", "what to do")
    assert page.text("#raw") == words
    press_mouse(page, "#more")
    page.wait("$('raw').offsetHeight > 0", "the robot's own words")
    page.run("localStorage.clear()")


def test_a_pressed_stop_is_seen_and_who_may_release_it(page, served):
    report(served)
    served.robot.emergency_stop.press()
    page.wait("$('stop').getAttribute('aria-pressed') === 'true'", "the pressed button")
    assert (page.text("#driver"), page.text("#can"), level(page)) == (
        "Emergency stop", "Sticks wait for the release", "2")
    served.ready_page().order("take")
    page.wait("$('release_why').offsetHeight > 0", "why this page may not release it")
    assert page.text("#release_why") == "Take over first"


def test_a_page_that_was_overtaken_is_told(page, served):
    drive_by_key(page, served)
    page.key("KeyW", down=False)
    served.ready_page().order("take")
    page.wait("$('message').textContent === 'Another page has taken over'", "the words")


def test_what_is_old_is_not_shown_as_if_it_were_of_now(browser, served):
    report(served, given={"velocity": [0.2, 0.0, 0.1], "measured": [0.1, 0.1, 0.1]}, board="this one",
           battery={"voltage": 12.0, "charge": 0.9})
    proxy = StallingProxy(served.port)
    page = open_page(browser, proxy)
    page.wait("$('speed').textContent === '0.20' && $('round_trip').textContent !== '–'", "numbers")
    proxy.stall()
    page.wait("['speed', 'turning', 'round_trip'].every((id) => $(id).textContent === '–') && "
              "document.querySelector('.wheels span.real').textContent === '–'", "no numbers")
    proxy.flow()
    page.wait("$('speed').textContent === '0.20'", "numbers")
    assert (page.text("#summary"), page.text("#charge")) == ("All is well (1)", "90 %")
    proxy.close()
    page.wait("$('summary').textContent === 'No connection' && !$('facts').innerText.includes('this one')",
              "a panel that knows nothing")
    assert page.run("$('lights').childElementCount") == 0
    assert page.box("#battery")[3] == 0, "its height"
    page.close()


def test_the_page_says_which_robot_it_is(browser, served):
    served.robot.name = "robot7"
    page = open_page(browser, served)
    assert page.run("document.title") == page.text("#robot") == "robot7"
    page.close()


def test_a_robot_that_reports_nothing_is_not_well_and_the_bar_has_units(page):
    page.wait("$('fault_words').innerText === 'The robot reports nothing'", "the bar")
    bars = []
    for button in ("closer", "farther", "farther", "farther", "farther"):
        press_mouse(page, f"#{button}")
        metres = float(page.text("#scale span").split()[0])
        bars.append(page.run("document.querySelector('#scale i').getBoundingClientRect().width") / metres)
    assert sorted(bars[1:], reverse=True) == bars[1:], "pixels per metre, as one goes farther away"


def test_the_camera_is_shown_picture_after_picture_and_an_old_one_is_not(browser, served, monkeypatch):
    monkeypatch.setattr("robotont_teleop.web.web_handlers.CAMERA_WAIT", 0.3)
    newest = [None]
    served.robot.camera = SimpleNamespace(picture=lambda: newest[-1])
    report(served, camera=True)
    page = open_page(browser, served)
    page.wait("$('app').dataset.main === 'camera'", "the camera first")
    for width in (64, 96):
        file = io.BytesIO()
        Image.new("RGB", (width, 48)).save(file, "JPEG")
        newest.append((width, file.getvalue()))
        page.wait(f"$('camera').naturalWidth === {width}", "the picture")
    press_mouse(page, "#swap")
    page.wait("$('app').dataset.main === 'map' && $('camera').offsetWidth < innerWidth / 2", "the map, by a tap")
    newest.append(None)
    page.wait("!$('camera').hasAttribute('src')", "the end of a picture that is old")
    assert [words for words in page.complaints() if "404" not in str(words)] == []
    page.close()


ROOM = {"number": 7, "width": 8.0, "height": 4.0, "origin": [-1.0, -1.0, 0.0]}


def on_map(server, pose=(0.0, 0.0, 0.5), velocity=None, **status):
    report(server, given={"pose": list(pose), "velocity": velocity},
           **{"frame": "map", "map": ROOM, "navigation": True, **status})


def pixels(page, part):
    """[px] of 1 in the coordinates of a part of the map."""
    return page.run(f"(({{a, b}}) => Math.hypot(a, b))(document.querySelector('#view {part}').getScreenCTM())")


def test_the_map_shows_the_robot_in_its_size_and_on_its_way_or_all_of_itself(page, served):
    served.robot.map_picture = png()
    on_map(served, velocity=[0.2, 0.0, 0.5], radius=0.2)
    page.wait("$('whole').offsetWidth > 0 && $('view').querySelector('.ahead').getAttribute('points')", "the map")
    metre = page.run("document.querySelector('#scale i').getBoundingClientRect().width") / float(
        page.text("#scale span").split()[0])
    assert pixels(page, ".robot") == pytest.approx(0.2 * metre, abs=0.5)
    ways = page.run("[...$('view').querySelector('.ahead').points].map(({x, y}) => [x, y])")
    assert ways[-1] == pytest.approx([0.4 * math.sin(0.75), 0.4 * (1 - math.cos(0.75))], abs=0.01), "1.5 s ahead"
    image = "document.querySelector('#view image').getScreenCTM()"
    turned = f"Math.atan2({image}.b, {image}.a)"  # of the map's x on the screen
    assert page.run(turned) == pytest.approx(-math.pi / 2)
    press_mouse(page, "#heading")
    page.wait(f"Math.abs({turned} + Math.PI / 2 - 0.5) < 0.01", "the robot upright")
    press_mouse(page, "#whole")
    page.wait("$('whole').getAttribute('aria-pressed') === 'true'", "the whole map")
    left, top, width, height = page.box("#view image")
    stage = page.box("#view")
    assert 0 <= left - stage[0] <= stage[2] - width
    assert 0 <= top - stage[1] <= stage[3] - height
    assert max(width / stage[2], height / stage[3]) > 0.85
    assert page.run("document.querySelector('#view .outside').getBBox().width") > 1000


def test_a_goal_is_seen_before_it_is_sent(page, served):
    served.robot.map_picture = png()
    on_map(served)
    page.wait("$('whole').offsetWidth > 0", "the map")
    page.finger(1, "#view", 0.1, 0.1)
    page.lift()  # too short
    page.finger(1, "#view", 0.3, 0.2)
    page.wait("!$('send').hidden", "the preview")
    assert page.run("!document.querySelector('.wish').hasAttribute('hidden')")
    before = page.text("#send")
    page.finger(1, "#view", 0.2, 0.2)
    page.wait(f"$('send').innerText !== {before!r}", "the place that follows the finger")
    page.lift()
    page.finger(1, "#view", -0.3, 0.2)
    page.wait("$('send').hidden", "its end by a tap")
    page.wait("!$('send').hidden", "another one")
    page.lift()
    half = page.box("#view")[2] / 2 / pixels(page, ".world")
    assert served.robot.orders == []
    assert page.text("#send") == f"Drive there: {math.hypot(0.3, 0.2) * half:.2f} m"
    press_mouse(page, "#send")
    kind, x, y = wait_for(lambda: served.robot.orders and served.robot.orders[-1], "the goal")
    assert (kind, x, y) == ("goal", pytest.approx(0.2 * half, abs=0.02), pytest.approx(0.3 * half, abs=0.02))
    on_map(served, frame="odom")
    page.wait("$('whole').hidden", "the end of the map")
    page.finger(1, "#view", 0.1, 0.1)
    page.run("new Promise((done) => setTimeout(done, 700))")
    assert page.run("$('send').hidden"), "no map, no place on it"


def test_what_is_near_stands_around_the_robot_on_the_map_and_on_the_camera(page, served):
    served.robot.map_picture = png()
    near = [1.5] * 6 + [0.15] + [None] * 17  # close on the left
    on_map(served, near=near)
    page.wait("document.querySelector('.near text').textContent === '0.15 m'", "the distance")
    left, top, width, height = page.box(".near .close")
    middle = page.box("#near")
    right, down = left + width / 2 - middle[0] - middle[2] / 2, top + height / 2 - middle[1] - middle[3] / 2
    assert math.atan2(-right, -down) == pytest.approx(math.pi / 2 + 0.5, abs=0.1), "as the robot looks"
    press_mouse(page, "#heading")
    page.wait(f"document.querySelector('.near .close').getBoundingClientRect().x < {left}", "the robot upright")
    press_mouse(page, "#heading")
    on_map(served, near=near, camera=True)
    page.wait("$('app').dataset.main === 'camera'", "the camera first")
    left, top, width, height = page.box(".near .close")
    middle = page.box("#near")
    assert left + width / 2 < middle[0] + middle[2] / 2
    assert top + height / 2 == pytest.approx(middle[1] + middle[3] / 2, abs=5)
    on_map(served, near=[None] * 24, camera=True)
    page.wait("document.querySelector('.near text').textContent === ''", "nothing near")


def png():
    file = io.BytesIO()
    Image.new("L", (80, 40)).save(file, "PNG")
    return file.getvalue()


@pytest.mark.parametrize("language", ["de", "et"])
def test_no_english_is_left_in_other_languages(page, served, language):
    """All that the page itself says; the robot's own words are marked as English."""
    report(served, {f"node: {name}": (found % 3, "in English words") for found, name in enumerate(LIGHTS)},
           battery={"voltage": 12.0, "charge": 0.1}, board="b", near=[0.5] * 24)
    page.wait(f"document.querySelectorAll('#lights li').length === {len(LIGHTS)}", "the lights")
    english = set(words(page))
    choose_language(page, language)
    page.wait(f"document.documentElement.lang === '{language}'", "the language")
    assert set(words(page)) & english - SAME <= set()
    page.run("localStorage.clear()")


SAME = {"Normal", "STOP", "English", "Deutsch", "Eesti", "Robotont", "Gamepad"}  # names, and what is the same
LIGHTS = ["black box", "board", "command stream", "gamepad", "guard", "gyro", "link", "localization", "real time",
          "stamps", "web page", "wheel feedback", "who drives"]  # of all nodes of the stack: `Health`


def words(page):
    """Each text of the page with letters that is not marked as English, labels and titles among them."""
    return page.run("""(() => {
        const found = [];
        const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        while (walk.nextNode()) {
          if (!walk.currentNode.parentElement.closest('[lang], kbd, script')) {
            found.push(walk.currentNode.textContent.trim());
          }
        }
        for (const one of document.body.querySelectorAll('*')) {
          found.push(one.title || '', one.getAttribute('aria-label') || '');
        }
        return found.filter((text) => /[a-zäöüõ]{2}/i.test(text) && !/^[0-9.,+ -]*(ms|m\\/s|rad\\/s|m)$/.test(text));
    })()""")


def test_nothing_moves_when_something_goes_wrong_and_the_release_is_found(page, served):
    """A person may be about to press it."""
    report(served)
    page.wait("$('fault').hidden", "a robot that is well")
    for size in (PHONE, PHONE_LYING, DESKTOP):
        page.look(size, False)
        page.wait(f"innerWidth === {size[0]}", "the screen")
        controls = ("#stop", "#move", "#turn", "#chips", "#closer", "#heading", "#view", "#details")
        before = [page.box(control) for control in controls]
        report(served, {LINK: (2, "is the cable in? " * 10)})
        served.robot.emergency_stop.press()
        page.wait("$('fault').offsetHeight * $('stopped').offsetHeight > 0", "both bars")
        assert [page.box(control) for control in controls] == before
        for _panel in range(2):  # open, and closed again
            page.tap("#details")
            x, y = page.place("#release")
            assert page.run(f"document.elementFromPoint({x}, {y}).closest('button')?.id") == "release", size
        release = page.box("#release")
        report(served)
        page.wait("$('fault').hidden", "the end of the fault")
        assert page.box("#release") == release
        served.robot.emergency_stop.release()
        report(served)
        page.wait("$('fault').hidden && $('stopped').hidden", "their end")


def test_a_token_that_is_typed_can_be_seen(browser, guarded):
    page = browser.page(f"http://127.0.0.1:{guarded.port}/login.html", script=FIND)  # whatever cookies are left
    page.wait("$('show') !== null", "the login page")
    page.run("$('token').value = 'x'")
    page.tap("#show")
    page.wait("$('token').type === 'text'", "the token")
    page.tap("#show")
    page.wait("$('token').type === 'password'", "dots")
    page.close()
