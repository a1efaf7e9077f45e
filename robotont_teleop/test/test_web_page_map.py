"""The map and the camera of the page in a real browser, on a server whose robot only takes notes."""

import math
from types import SimpleNamespace

import pytest
from page_client import open_page, png, press_mouse, report

from robotont_testing.harness import wait_for


def test_the_camera_is_shown_picture_after_picture_and_an_old_one_is_not(browser, served, monkeypatch):
    monkeypatch.setattr("robotont_teleop.web.web_handlers.CAMERA_WAIT", 0.3)
    newest = [None]
    served.robot.camera = SimpleNamespace(picture=lambda: newest[-1])
    report(served, camera=True)
    page = open_page(browser, served)
    page.wait("$('app').dataset.main === 'camera'", "the camera first")
    for width in (64, 96):
        newest.append((width, png(width)))
        page.wait(f"$('camera').naturalWidth === {width}", "the picture")
    newest.append(None)
    page.wait("!$('camera').hasAttribute('src')", "the end of a picture that is old")
    assert [words for words in page.complaints() if "404" not in str(words)] == []
    page.close()


ROOM = {"number": 7, "width": 8.0, "height": 4.0, "origin": [-1.0, -1.0, 0.0]}


def on_map(server, **status):
    server.robot.map_picture = png()
    report(server, given={"pose": [0.0, 0.0, 0.5]}, **{"frame": "map", "map": ROOM, "navigation": True, **status})


def pixels(page, part):
    """[px] of 1 in the coordinates of a part of the map."""
    return page.run(f"(({{a, b}}) => Math.hypot(a, b))(document.querySelector('#view {part}').getScreenCTM())")


def test_the_map_shows_the_robot_in_its_size_or_all_of_itself(page, served):
    on_map(served, radius=0.2)
    page.wait("!document.querySelector('.ground').hasAttribute('hidden')", "the map")
    assert pixels(page, ".robot") == pytest.approx(0.2 * pixels(page, ".world"), abs=0.5)
    image = "document.querySelector('#view image').getScreenCTM()"
    turned = f"Math.atan2({image}.b, {image}.a)"  # of the map's x on the screen
    assert page.run(turned) == pytest.approx(-math.pi / 2)
    press_mouse(page, "#heading")
    page.wait(f"Math.abs({turned} + Math.PI / 2 - 0.5) < 0.01", "the robot upright")
    press_mouse(page, "#whole")
    page.wait("$('whole').getAttribute('aria-pressed') === 'true'", "the whole map")
    assert page.box("#view image")[3] == pytest.approx(0.9 * page.box("#view")[3], abs=1.0)


def test_the_reset_of_the_odometry_says_what_it_moves(page, served):
    report(served)
    page.wait("document.querySelector('#reset_odometry ~ small').innerText.includes('may lose the robot')",
              "the words beside it")
    press_mouse(page, "#reset_odometry")
    wait_for(lambda: served.robot.orders == [("reset_odometry",)], "the order")


def test_a_goal_is_seen_before_it_is_sent(page, served):
    on_map(served)
    page.wait("!document.querySelector('.ground').hasAttribute('hidden')", "the map")
    page.finger(1, "#view", 0.3, 0.2)
    page.wait("!$('send').hidden", "the preview")
    page.finger(1, "#view", -0.3, 0.2)
    page.lift()
    half = page.box("#view")[2] / 2 / pixels(page, ".world")
    assert served.robot.orders == []
    assert page.text("#send") == f"Drive there: {math.hypot(0.3, 0.2) * half:.2f} m"
    press_mouse(page, "#send")
    kind, x, y = wait_for(lambda: served.robot.orders and served.robot.orders[-1], "the goal")
    assert (kind, x, y) == ("goal", pytest.approx(0.2 * half, abs=0.02), pytest.approx(0.3 * half, abs=0.02))
    on_map(served, frame="odom")
    page.wait("document.querySelector('.ground').hasAttribute('hidden')", "the end of the map")
    page.finger(1, "#view", 0.1, 0.1)
    page.run("new Promise((done) => setTimeout(done, 700))")
    assert page.run("$('send').hidden"), "no map, no place on it"


def test_what_is_near_stands_around_the_robot_on_the_map_and_on_the_camera(page, served):
    near = [1.5] * 6 + [0.15] + [None] * 17  # close on the left
    bearing = "(({x, y}) => Math.atan2(-x, -y))(document.querySelector('.near .close').getPointAtLength(10))"
    on_map(served, near=near)
    page.wait("document.querySelector('.near text').textContent === '0.15 m'", "the distance")
    assert page.run(bearing) == pytest.approx(math.pi / 2 + 0.5, abs=0.1), "as the robot looks"
    on_map(served, near=near, camera=True)
    page.wait("$('app').dataset.main === 'camera'", "the camera first")
    assert page.run(bearing) == pytest.approx(math.pi / 2, abs=0.1)
