"""Whatever starts before the mux, nothing of a hand reaches cmd_vel but through it, and each hand drives."""

import itertools
import os

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
from terminal import Terminal
from web_client import Client

from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_testing import places
from robotont_testing.harness import Master, free_port, in_own_process, wait_for

# Stand-ins of the packages joy and teleop_twist_joy, which Debian lacks; this test has the stick.
TWIST = """import rospy
from geometry_msgs.msg import Twist, Vector3
from sensor_msgs.msg import Joy
rospy.init_node("teleop_twist_joy")
publisher, given = rospy.Publisher("cmd_vel", Twist, queue_size=1), rospy.get_param("~")
def on_joy(message):
    if message.buttons[given["enable_button"]]:
        publisher.publish(Vector3(x=given["scale_linear"]["x"] * message.axes[given["axis_linear"]["x"]]), Vector3())
rospy.Subscriber("joy", Joy, on_joy)
rospy.spin()
"""


@in_own_process
def test_the_hands_first():
    """Other tests have the robot first."""
    with Master() as master, Client(free_port()) as client:
        for name, program, text in (("joy", "joy_node", "import signal; signal.pause()"),
                                    ("teleop_twist_joy", "teleop_node", TWIST)):
            (master.folder / name).mkdir()
            (master.folder / name / "package.xml").write_text(f"<package><name>{name}</name></package>")
            (master.folder / name / program).write_text("#!/usr/bin/env python3\n" + text)
            (master.folder / name / program).chmod(0o755)
        os.environ["ROS_PACKAGE_PATH"] = f"{master.folder}:{os.environ['ROS_PACKAGE_PATH']}"
        rospy.init_node("hands", disable_signals=True)
        senders, hands = set(), set()
        rospy.Subscriber("cmd_vel", Twist, lambda message: senders.add(connection_header(message)["callerid"]))
        rospy.Subscriber("cmd_vel/hand", Twist, lambda message: message.linear.x and hands.add(
            connection_header(message)["callerid"]))
        keys, stick, positions = Terminal(), rospy.Publisher("joy", Joy, queue_size=1), itertools.cycle((0.5, 0.6))
        master.launch("teleop.launch", "gamepad:=true", f"web_port:={client.port}")
        try:
            page = client.awaited_page()
            master.start(places.program("robotont_teleop", "cmd_vel_mux"))

            def each_has_driven():
                page.drive(0.2)
                keys.type("w")
                stick.publish(axes=[0, next(positions), 0, 0], buttons=[0, 0, 0, 0, 1, 0, 0, 0])
                return len(hands) == 3 and senders
            wait_for(each_has_driven, "all three hands", 60.0, period=0.1)
            publishers, subscribers, _ = rosgraph.Master("/test").getSystemState()
            assert "/joy/live" in dict(subscribers), "a stick out of reach drives on"
            assert senders | set(dict(publishers)["/cmd_vel"]) == {"/cmd_vel_mux"}
        finally:
            keys.end()
