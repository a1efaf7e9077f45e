"""The page in a real browser, on a server whose robot only takes notes: hands, head, faults, languages."""

from page_client import FIND, LINK, OPEN, WHEELS, drives, open_page, press_mouse, report
from web_client import TOKEN

from robotont_testing.browser import DESKTOP, PHONE
from robotont_testing.harness import again_until, wait_for
from robotont_testing.stalling_proxy import StallingProxy


def drive_by_key(page, server, key="KeyW", moves=drives):
    """As a person does it: whoever sees that a stall has taken the key lets go of it and presses it again."""
    def press():
        page.key(key, down=False)
        page.key(key, down=True)
    again_until(press, lambda: moves(server), key)


SWALLOWERS = {  # what a browser tells of it: here the system's own shortcuts would swallow them
    "Cmd": "new KeyboardEvent('keydown', {code: 'MetaLeft', metaKey: true})",
    "the end of Cmd": "new KeyboardEvent('keyup', {code: 'MetaLeft'})",
    "Ctrl and a key": "new KeyboardEvent('keydown', {code: 'KeyT', ctrlKey: true})",
    "Alt": "new KeyboardEvent('keydown', {code: 'AltLeft', altKey: true})",
    "losing the focus": "new Event('blur')",
    "a context menu": "new Event('contextmenu')"}


def test_whatever_may_swallow_the_end_of_a_key_stops(page, served):
    for what, event in SWALLOWERS.items():
        drive_by_key(page, served)
        page.run(f"window.dispatchEvent({event}) && 0")
        wait_for(lambda: not drives(served), f"the stop after {what}")
        page.run("new Promise((done) => setTimeout(done, 100))")
        assert not drives(served), what
        page.key("KeyW", down=False)
    drive_by_key(page, served)


def test_stop_needs_no_words(browser, served):
    """Nor the gamepads that browsers do not show over http."""
    words = served.server.files.pop("texts.json")
    page = open_page(browser, served, script="delete Navigator.prototype.getGamepads;")
    page.tap("#stop")
    wait_for(lambda: served.robot.stopped, "STOP")
    assert not page.run("$('stop').ariaLabel")
    served.server.files["texts.json"] = words
    page.wait("$('stop').ariaLabel && $('language').textContent === 'Deutsch'", "the words, which are asked for again")
    page.run("document.dispatchEvent(new Event('visibilitychange', {bubbles: true})) && 0")
    assert [words for words in page.complaints() if "404" not in str(words)] == []
    page.close()


def test_a_thumb_that_rests_on_its_stick_drives_on_until_it_is_cancelled(page, served):
    """Android reports a long press as a request for the context menu; the stick refuses it, so that none opens."""
    page.push_until(lambda: drives(served), "motion", "#move", up=0.9)
    assert not page.run("$('move').dispatchEvent(new MouseEvent('contextmenu', "
                        "{bubbles: true, cancelable: true}))")
    page.run("new Promise((done) => setTimeout(done, 300))")
    assert drives(served)
    page.cancel_fingers()
    wait_for(lambda: not drives(served), "the stop")


def test_whatever_button_has_the_focus_keys_drive_and_choose_the_speed_and_space_stops(page, served):
    """What has got it by the mouse and what has got it by the keys alike."""
    press_mouse(page, "#language")
    page.wait("document.documentElement.lang === 'de'", "the next language")
    for key, axis, chip, size in (
            ("KeyW", 0, 1, 0.15), ("ArrowUp", 0, 3, 0.5), ("KeyA", 1, 2, 0.3), ("KeyQ", 2, 3, 2.0)):
        page.key(f"Digit{chip}", down=True)
        drive_by_key(page, served, key, lambda server, axis=axis, size=size:
                     drives(server) and abs(server.robot.sent[-1][axis] - size) < 1e-6)
        assert page.run(f"$('chips').children[{chip - 1}].ariaPressed") == "true"
        page.key(key, down=False)
        wait_for(lambda: not drives(served), "the stop")
    for place, element in enumerate(("language", "stop", "reset_odometry")):
        page.run(f"$({element!r}).focus()")
        for kind, text in (("keyDown", " "), ("keyUp", "")):  # with all that browsers need to act on it themselves
            page.call("Input.dispatchKeyEvent", type=kind, code="Space", key=" ", windowsVirtualKeyCode=32, text=text)
        wait_for(lambda place=place: served.robot.orders.count(("press",)) > place, f"the stop from {element}")
    page.run("document.body.dispatchEvent(new KeyboardEvent('keydown', {key: ' ', bubbles: true})) && 0")
    wait_for(lambda: served.robot.orders.count(("press",)) > 3, "the stop by a space bar of which no code is known")
    assert page.run("document.documentElement.lang") == "de", "the space bar pressed the button as well"


def test_a_wrong_token_is_told_and_the_right_one_leaves_the_address_each_time_the_code_is_scanned(browser, guarded):
    browser.call("Storage.clearCookies")
    page = browser.page(f"http://127.0.0.1:{guarded.port}/#token=a-wrong-one", PHONE, script=FIND)
    page.wait("$('answer')?.hidden === false && $('answer').innerText === 'Wrong token'", "words")
    assert page.run("($('token').value = 'what a browser keeps') && dispatchEvent(new Event('pagehide')) && "
                    "$('token').value") == ""  # of a page that it may show again as it was left
    page.run(f"($('token').value = ' {TOKEN}') && document.querySelector('[type=submit]').click()")
    page.wait(OPEN, "the page")
    page.close()
    for _ in range(2):  # the login page has it first, then the page itself
        page = open_page(browser, guarded, f"#token={TOKEN}")
        assert page.run("location.href") == f"http://127.0.0.1:{guarded.port}/"
        page.run(f"location.hash = 'token={TOKEN}' && 0")  # a code that opens in the same tab
        page.wait("!location.href.includes('token')", "the address without the token")
        page.close()


def test_a_gamepad_is_let_go_of_also_where_the_browser_draws_nothing(browser, served):
    """As in a window that another one covers."""
    page = open_page(browser, served, script="""window.requestAnimationFrame = () => 0;
window.pad = {index: 0, connected: true, mapping: "standard", axes: [0, 0, 0, 0],
  buttons: Array.from({length: 17}, (_, number) => ({pressed: number === 4, value: Number(number === 4)}))};
navigator.getGamepads = () => [null, window.pad];""")
    page.run("window.dispatchEvent(new Event('gamepadconnected')) && 0")
    def push():
        """Again: a stick that is already held when the page first looks does not drive."""
        page.run("(pad.axes = [0, 0, 0, 0]) && new Promise((done) => setTimeout(done, 200))")
        page.run("(pad.axes = [0, -1, 0, 0]) && 0")
    again_until(push, lambda: drives(served), "motion")
    page.run("(pad.axes = [0, 0, 0, 0]) && 0")
    wait_for(lambda: not drives(served), "the stop", 1.0)
    page.run("(pad.buttons[1] = {pressed: true, value: 1}) && 0")
    wait_for(lambda: served.robot.stopped, "STOP")
    page.close()


FAULTS = (
    ({LINK: (2, "/dev/x: no such file"), WHEELS: (1, "no packets")},
     "Link to the board The board's cable is out, or the board is off", "Board not reached: sticks are off"),
    ({LINK: (0, ""), WHEELS: (1, "wheel 2 stands")}, "Wheels A wheel does not turn as told: is it blocked?",
     "Push a stick to drive"),
    ({LINK: (1, "no packets")}, "Link to the board Board silent: is it switched on?",
     "Board may not obey: try a stick"),
    ({"other: thing": (2, "it burns")}, "thing it burns", "Push a stick to drive"))


def test_the_worst_fault_stands_where_one_looks(page, served):
    page.wait("$('fault_words').innerText === 'The robot reports nothing'", "the bar of one that reports nothing")
    for fault, words, can in FAULTS:
        report(served, fault)
        page.wait(f"document.querySelector('#fault p').innerText === {words!r}", "the bar")
        assert page.text("#can") == can
        assert page.run("$('dot').dataset.level") == str(max(found for found, _ in fault.values()))
    report(served)
    page.wait("$('fault').hidden && $('dot').dataset.level === '0'", "its end")
    assert page.text("#summary") == "All is well (1)"


def test_a_pressed_stop_is_seen_and_who_may_release_it(page, served):
    report(served, given={"stopped_by_class": True})
    served.robot.emergency_stop.press()
    page.wait("$('stop').getAttribute('aria-pressed') === 'true'", "the pressed button")
    assert (page.text("#driver"), page.text("#can"), page.run("$('dot').dataset.level"), page.text("#stopped_by")) == (
        "Emergency stop", "Sticks wait for the release", "2", "Stopped by the class's page: release it there")
    served.ready_page().order("take")
    page.wait("$('release').disabled && $('release').innerText === 'Take over first'", "why it may not release it")


def test_a_stall_shows_nothing_old_and_a_stop_that_it_swallows_goes_out_on_the_next_connection(browser, served):
    report(served, given={"velocity": [0.2, 0.0, 0.1]})
    kind, code = served.server.files["server_link.js"]
    assert b"LOST = 6000;" in code
    served.server.files["server_link.js"] = kind, code.replace(b"LOST = 6000;", b"LOST = 1500;")
    proxy = StallingProxy(served.port)
    page = open_page(browser, proxy, script="window.sockets = 0; window.WebSocket = class extends WebSocket {"
                     "constructor(...given) { super(...given); window.sockets += 1; }};")
    page.wait("$('speed').textContent === '0.20' && $('turning').textContent === '0.10'", "numbers")
    proxy.stall()
    page.wait("['speed', 'turning'].every((id) => $(id).textContent === '–')", "no numbers")
    for _look in range(2):
        assert not page.run("new Promise((done) => setTimeout(() => done($('view').classList.contains('live')), 275))")
    page.tap("#stop")
    page.wait("$('stop_waits').offsetWidth === innerWidth", "a bar over the whole width")
    assert not served.robot.stopped
    page.wait("window.sockets > 1", "a new connection instead of the dead one")
    proxy.cut()
    proxy.flow()
    wait_for(lambda: served.robot.stopped, "the stop")
    page.wait("$('stop_waits').hidden && !$('stopped').hidden", "words about the stop")
    proxy.close()
    page.wait("$('summary').textContent === 'No connection'", "a panel that knows nothing")
    page.close()


def test_nothing_moves_when_something_goes_wrong_and_the_release_is_found(page, served):
    """A person may be about to press it."""
    report(served)
    page.wait("$('fault').hidden", "a robot that is well")
    for size in (PHONE, DESKTOP):
        page.look(size, False)
        page.wait(f"innerWidth === {size[0]}", "the screen")
        controls = ("#stop", "#move", "#turn", "#chips", "#whole", "#heading", "#view", "#details")
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
