"""keyboard_teleop without ROS and terminal: what keys do, and what its line shows."""

import os
from unittest.mock import Mock

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool, String

from robotont_teleop.hand import emergency_stop_publisher, keyboard_teleop, robot_reports
from robotont_testing.bus import Bus, waiting_for_nobody

STOP = (0.0, 0.0, 0.0)


class Keys(Bus):
    """The node with a mux and a driver_node; line: what it shows."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch, keyboard_teleop, robot_reports, emergency_stop_publisher)
        self.connections.update(dict.fromkeys(("cmd_vel/hand", "cmd_vel/driven_by"), 1))
        self.line, self.release = "", Mock()  # its call: asked for
        monkeypatch.setattr(keyboard_teleop, "PUBLISH_PERIOD", 0.0)
        monkeypatch.setattr(keyboard_teleop, "_write", self._show)
        monkeypatch.setattr(emergency_stop_publisher, "ServiceRequest", lambda *_: self.release)
        terminal, self._keyboard = os.pipe()
        given = {one.name: one.default for one in keyboard_teleop.PARAMETERS}
        self.node = keyboard_teleop.KeyboardTeleop(given, terminal)
        assert self.type("w") == STOP, "a key that came while it started is old"
        self.settle()

    def _show(self, text):
        self.line = text[len("\r"):-len("\x1b[K")]

    def type(self, text="", after=0.05):
        """Keys come, and it looks; the newest command."""
        self.now += after
        os.write(self._keyboard, text.encode("utf-8", "surrogateescape"))
        with waiting_for_nobody():
            for key in self.node._read():
                self.node._take(key)
            self.node._send()
        self.node._show()
        newest = self.sent["cmd_vel/hand"][-1] if self.sent["cmd_vel/hand"] else Twist()
        return newest.linear.x, newest.linear.y, newest.angular.z

    def settle(self):
        """Nothing that comes now has waited."""
        for _ in range(8):
            self.type()

    def press(self, names):
        """driver_node says who presses."""
        self.hear("emergency_stop/pressed_by", String(names))


@pytest.fixture
def keys(monkeypatch):
    return Keys(monkeypatch)


def test_keys_drive_and_the_line_shows_it(keys):
    assert "no odometry" in keys.line
    odometry = Odometry()
    odometry.twist.twist.linear.y = 0.25
    keys.hear("odom", odometry)
    keys.hear("cmd_vel/driven_by", String("hand"))
    keys.type("+")
    assert keys.line.startswith("0.33 1.10 | sent")
    assert keys.type("-a\x1b[D") == pytest.approx((0.0, 0.3, 1.0))
    assert keys.line == "0.30 1.00 | sent +0.00 +0.30 +1.00 | mux: hand | robot +0.00 +0.25 +0.00"
    assert keys.type(after=1.0) == STOP


def test_the_line_says_why_the_robot_does_not_obey(keys):
    words = "in the way: something ahead, 0.06 m from the robot"
    keys.hear("/diagnostics", DiagnosticArray(status=[DiagnosticStatus(
        name="another: guard", level=DiagnosticStatus.WARN, message=words)]))
    keys.type("w")
    assert keys.line.endswith(f"| {words}")
    keys.type("s")
    assert "sent +0.00" in keys.line, "the usual line, at rest"


def test_where_nobody_listens_the_line_says_what_to_do(keys, monkeypatch):
    """As behind a robot's restart: its new master does not know these keys."""
    monkeypatch.setattr(keyboard_teleop.rospy, "resolve_name", "/robot1/{}".format)
    keys.connections["cmd_vel/hand"] = 0
    keys.type()
    assert keys.line == "no mux hears /robot1/cmd_vel/hand: keys again, keys __ns:=/NAME, or start_mux:=true"
    for count in (0, 1):
        keys.connections["cmd_vel/hand"] = count
        keys.type(" ")
        assert "THE ROBOT HAS NOT CONFIRMED" in keys.line, "nobody has heard the stop"


def test_a_key_that_means_nothing_is_told_until_the_next_one_and_hides_no_stop(keys):
    keys.type("x")
    assert keys.line.startswith("this key does nothing")
    keys.press("/other")
    keys.type()
    assert "EMERGENCY STOP, Ctrl-U releases it" in keys.line
    keys.type(" ")
    assert "THE ROBOT HAS NOT CONFIRMED" in keys.line
    keys.press("/node, /other")
    keys.type("x\x15")
    keys.press("")
    keys.type(after=2.0)
    assert "sent +0.00" in keys.line


def test_space_is_the_emergency_stop_and_that_of_others_lets_go_of_the_keys_too(keys):
    for press in (lambda: keys.type(" "), lambda: keys.press("/other")):
        assert keys.type("w") != STOP
        press()
        assert keys.type() == STOP
        keys.press("/node, /other")
        assert keys.type("www") == STOP
        assert "EMERGENCY STOP, Ctrl-U releases it" in keys.line
        keys.press("/node, /robot1/fleet_node")
        keys.type()
        assert "EMERGENCY STOP, the class's page releases it" in keys.line
        keys.release.reset_mock()
        keys.type("\x15")
        keys.release.call.assert_called_once_with()
        keys.press("")
        keys.now += 2.0  # behind which another's release ends the own press
        assert keys.type() == STOP
        keys.settle()
        assert keys.type() == STOP
    assert keys.sent["emergency_stop"] == [Bool(True), Bool(False)]


@pytest.mark.parametrize("blank", ["\0", "\xa0", "\udca0", "\u200c", "\u202f", "\u3000", "\x1b[\xa0"])
def test_space_stops_whatever_key_is_held_with_it_and_in_other_encodings(keys, blank):
    """Ctrl; Alt Gr, in Latin-1 too; Shift in Persian; Alt Gr and Shift in French; Japanese."""
    assert keys.type("w") != STOP
    assert keys.type(blank) == STOP
    assert keys.sent["emergency_stop"] == [Bool(True)]


def test_of_keys_that_came_while_it_was_held_up_the_stop_alone_counts(keys):
    keys.type("w")
    assert keys.type(after=0.6) == STOP, "driven on by a key that may be up"
    assert keys.type("w", after=1.0) == STOP
    assert keys.type() == STOP
    keys.settle()
    assert keys.type(260 * "w") == STOP, "as a network hands on what has waited in it"
    keys.press("/other")
    keys.type("\x15", after=1.0)
    assert not keys.release.call.called, "released by a key from before the press"
    keys.type("w ", after=1.0)
    assert keys.sent["emergency_stop"] == [Bool(True)]
