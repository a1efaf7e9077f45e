"""Whatever starts before the robot, nothing of a hand reaches cmd_vel but through the mux, and each hand drives."""

import contextlib
import os
import stat

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from rostest_keyboard_teleop import Terminal
from std_msgs.msg import String
from web_client import Client

from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_testing.harness import Master, free_port, in_own_process, wait_for
from robotont_testing.stand_in_board import Board

# Stand-ins of the packages joy and teleop_twist_joy, which Debian lacks: a stick that moves while its button is held.
JOY = """import rospy
from sensor_msgs.msg import Joy
rospy.init_node("joy_node")
publisher, rate, number = rospy.Publisher("joy", Joy, queue_size=1), rospy.Rate(20), 0
while not rospy.is_shutdown():
    number += 1
    publisher.publish(Joy(axes=[0, 0.5 + 0.01 * (number % 2), 0, 0], buttons=[0, 0, 0, 0, 1, 0, 0, 0]))
    rate.sleep()
"""
TWIST = """import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
rospy.init_node("teleop_twist_joy")
publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
def on_joy(message):
    twist = Twist()
    twist.linear.x = rospy.get_param("~scale_linear/x") * message.axes[rospy.get_param("~axis_linear/x")]
    if message.buttons[rospy.get_param("~enable_button")]:
        publisher.publish(twist)
rospy.Subscriber("joy", Joy, on_joy)
rospy.spin()
"""


def make_package(folder, name, program, text):
    (folder / name).mkdir()
    (folder / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
    file = folder / name / program
    file.write_text("#!/usr/bin/env python3\n" + text)
    file.chmod(file.stat().st_mode | stat.S_IXUSR)


class Heard:
    """What comes on the topics of commands, and by whom."""

    def __init__(self):
        self.senders, self.hands, self.drivers = set(), set(), set()
        rospy.Subscriber("cmd_vel", Twist, lambda message: self.senders.add(name_of(message)))
        rospy.Subscriber("cmd_vel/hand", Twist, lambda message: message.linear.x and self.hands.add(name_of(message)))
        rospy.Subscriber("cmd_vel/driven_by", String, lambda message: self.drivers.add(message.data))


def name_of(message):
    return connection_header(message)["callerid"]


def drive_by_each(master, order):
    """Start all in an order, drive by each hand; the nodes by which commands came, or could come, on cmd_vel."""
    heard, board, port = Heard(), Board(str(master.folder / "board")), free_port()
    board.plug()
    starts = {"robot": lambda: master.launch("robot.launch", f"port:={board.link}", "description:=false"),
              "page": lambda: master.launch("teleop.launch", f"web_port:={port}"),
              "gamepad": lambda: master.launch("gamepad.launch"),
              "keys": Terminal}
    started = {part: starts[part]() for part in order}
    try:
        with Client(port) as client:
            page = wait_for(lambda: open_page(client), "the page", 60.0, period=0.2)

            def each_has_driven():
                page.drive(0.2)
                started["keys"].type("w")
                return len(heard.hands) == 3 and "hand" in heard.drivers and any(board.speeds)
            wait_for(each_has_driven, "all three hands", 60.0, period=0.1)
        publishers, _, _ = rosgraph.Master("/test").getSystemState()
        return heard.senders | set(dict(publishers)["/cmd_vel"])
    finally:
        started.pop("keys").end()
        for process in started.values():
            master.stop(process)
        board.close()


def open_page(client):
    with contextlib.suppress(OSError):
        return client.ready_page()


@in_own_process
def test_the_hands_first():
    """Other tests have the robot first."""
    with Master() as master:
        make_package(master.folder, "joy", "joy_node", JOY)
        make_package(master.folder, "teleop_twist_joy", "teleop_node", TWIST)
        os.environ["ROS_PACKAGE_PATH"] = f"{master.folder}:{os.environ['ROS_PACKAGE_PATH']}"
        rospy.init_node("hands", disable_signals=True)
        rospy.set_param("/run_id", "hands")  # of two roslaunches that make one at once the second ends
        assert drive_by_each(master, ("keys", "gamepad", "page", "robot")) == {"/cmd_vel_mux"}
