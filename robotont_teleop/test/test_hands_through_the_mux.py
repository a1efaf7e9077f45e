"""Whatever starts before the robot, nothing of a hand reaches cmd_vel but through the mux, and each hand drives."""

import contextlib
import os

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from terminal import Terminal
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
    file.chmod(0o755)


def open_page(client):
    with contextlib.suppress(OSError):
        return client.ready_page()


@in_own_process
def test_the_hands_first():
    """Other tests have the robot first."""
    with Master() as master, Client(free_port()) as client:
        make_package(master.folder, "joy", "joy_node", JOY)
        make_package(master.folder, "teleop_twist_joy", "teleop_node", TWIST)
        os.environ["ROS_PACKAGE_PATH"] = f"{master.folder}:{os.environ['ROS_PACKAGE_PATH']}"
        rospy.init_node("hands", disable_signals=True)
        rospy.set_param("/run_id", "hands")  # of two roslaunches that make one at once the second ends
        senders, hands = set(), set()
        rospy.Subscriber("cmd_vel", Twist, lambda message: senders.add(connection_header(message)["callerid"]))
        rospy.Subscriber("cmd_vel/hand", Twist, lambda message: message.linear.x and hands.add(
            connection_header(message)["callerid"]))
        keys, board = Terminal(), Board(str(master.folder / "board"))
        board.plug()
        master.launch("gamepad.launch")
        master.launch("teleop.launch", f"web_port:={client.port}")
        master.launch("robot.launch", f"port:={board.link}", "description:=false")
        try:
            page = wait_for(lambda: open_page(client), "the page", 60.0, period=0.2)

            def each_has_driven():
                page.drive(0.2)
                keys.type("w")
                return len(hands) == 3 and any(board.speeds)
            wait_for(each_has_driven, "all three hands", 60.0, period=0.1)
            publishers, _, _ = rosgraph.Master("/test").getSystemState()
            assert senders | set(dict(publishers)["/cmd_vel"]) == {"/cmd_vel_mux"}
        finally:
            keys.end()
            board.close()
