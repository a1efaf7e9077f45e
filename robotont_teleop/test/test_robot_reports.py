"""A page shows the faults of its own robot, among several on one master."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from tf2_msgs.msg import TFMessage

from robotont_teleop.hand import robot_reports
from robotont_teleop.hand.robot_reports import RobotReports
from robotont_teleop.web import frame_chain
from robotont_testing.bus import Bus, transform

TOLD = [DiagnosticStatus(name=name, hardware_id=robot, level=2, message="/dev/x: no such file",
                         values=[KeyValue("rate", "49.5 Hz"), KeyValue("driver", "")]) for name, robot in (
    ("robot1/serial_com_node: link", "robot1"), ("robot2/serial_com_node: link", "robot2"),
    ("serial_com_node: link", "robotont"), ("camera/driver: temperature", "R200"))]


@pytest.fixture(autouse=True)
def bus(monkeypatch):
    return Bus(monkeypatch, robot_reports, frame_chain)


@pytest.mark.parametrize("namespace, own", [
    ("/robot1/", ["robot1/serial_com_node: link"]), ("/", ["camera/driver: temperature", "serial_com_node: link"])])
def test_faults_of_the_own_robot_only(monkeypatch, namespace, own):
    monkeypatch.setattr("rospy.get_namespace", lambda: namespace)
    reports = RobotReports()
    for order in (TOLD[::-1], TOLD, TOLD[::-1]):
        reports._on_diagnostics(DiagnosticArray(status=order))
    assert [light["name"] for light in reports.lights] == list(reports.values) == own
    assert {light["key"] for light in reports.lights if "link" in light["name"]} == {"port_missing"}
    assert reports.values[own[0]] == {"level": 2, "rate": 49.5}


@pytest.mark.parametrize("percentage, task, key, lights", [
    (0.1, "odom_node: gyro", "", [("battery", 1, "battery_low"), ("odom_node: gyro", 0, "")]),
    (0.1, "serial_com_node: board", "battery_low", [("serial_com_node: board", 2, "battery_low")]),
    (0.5, "odom_node: gyro", "", [("odom_node: gyro", 0, "")]),
    *((unknown, "odom_node: gyro", "", [("odom_node: gyro", 0, "")]) for unknown in (float("nan"), -1.0, 85.0))])
def test_a_battery_that_is_low_is_a_light_once(percentage, task, key, lights):
    reports = RobotReports()
    reports._on_battery(BatteryState(percentage=percentage))
    reports._on_diagnostics(DiagnosticArray(status=[DiagnosticStatus(
        name=task, level=2 * bool(key), message="the battery is low" if key else "well")]))
    assert [(light["name"], light["level"], light["key"]) for light in reports.lights] == lights


def test_pages_and_fleet_are_told_the_same_worst_and_that_a_task_has_fallen_silent(bus):
    reports = RobotReports()

    def say(name, level):
        reports._on_diagnostics(DiagnosticArray(status=[DiagnosticStatus(name=name, level=level, message="in words")]))
    say("a: well", 0)
    say("b: link", 1)
    assert reports.worst == {"task": "b: link", "level": 1, "words": "in words", "fault": ""}
    bus.now += 6.0
    say("c: link", 2)
    assert reports.worst["task"] == reports.lights[0]["name"] == "c: link"
    assert [(light["level"], light["words"], light["key"]) for light in reports.lights[1:]] == [
        (3, "silent for over 5 s", "silent")] * 2


def test_what_was_heard_before_the_computer_slept_is_old(bus):
    """time.monotonic() stands still meanwhile."""
    reports, chain, found = RobotReports(), frame_chain.FrameChain(), []
    chain.listen()
    for topic, message in (("/tf", TFMessage([transform("odom", "base_link")])), ("odom", Odometry()),
                           ("battery", BatteryState(percentage=0.5)),
                           ("/diagnostics", DiagnosticArray(status=[DiagnosticStatus(name="a: b")]))):
        bus.hear(topic, message)
    for _ in range(2):
        found.append((reports.velocity is None, reports.battery is None, reports.worst["fault"],
                      chain.pose("base_link", bus.now)[1] is None))
        bus.now += 20.0
    assert found == [(False, False, "", False), (True, True, "silent", True)]
