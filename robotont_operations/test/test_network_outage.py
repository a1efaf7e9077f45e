"""A cable that is cut in mid-drive: the robot stops, and drives again at once when the cable is mended."""

import os
import time

import pytest

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.stand_in_board import Board
from robotont_testing.two_machines import ADDRESSES, NoNamespacesError, TwoMachines

ROBOT, LAPTOP = ADDRESSES["robot"], ADDRESSES["laptop"]
MASTER = {"ROS_MASTER_URI": f"http://{ROBOT}:11311"}
# drives, and presses the emergency stop when the file sys.argv[1] appears
COMMANDER = """
import os, sys, rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool
rospy.init_node("commander")
drive = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
stop = rospy.Publisher("emergency_stop", Bool, queue_size=1)
command = Twist()
command.linear.x = 0.3
pressed = False
while not rospy.is_shutdown():
    drive.publish(command)
    if not pressed and os.path.exists(sys.argv[1]):
        pressed = True
        stop.publish(True)
    rospy.sleep(0.05)
"""

pytestmark = pytest.mark.timed


@pytest.fixture
def machines():
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_MASTER_URI"):
        os.environ.pop(name, None)
    try:
        two = TwoMachines()
    except NoNamespacesError as error:
        pytest.skip(str(error))
    with two, Board(str(two.folder / "board")) as board:
        robot = {**MASTER, "ROS_IP": ROBOT, "ROS_LOG_DIR": str(two.folder)}
        two.on("robot", "roslaunch", places.launch("robot.launch"), f"port:={board.link}", "description:=false",
               log=two.folder / "robot.log", **robot)
        two.on("laptop", "/usr/bin/python3", "-c", COMMANDER, two.folder / "press", log=two.folder / "laptop.log",
               **{**robot, "ROS_IP": LAPTOP})
        wait_for(lambda: any(board.speeds), "motion", timeout=60)
        two.board = board
        yield two


def seconds_until(condition, what):
    before = time.monotonic()
    wait_for(condition, what, timeout=90.0)
    return time.monotonic() - before


@pytest.mark.parametrize("outage, carrier", [(1.0, False), (8.0, False), (8.0, True)])
def test_the_robot_stops_at_once_and_drives_again_at_once(machines, outage, carrier):
    board = machines.board
    machines.cut(carrier)
    assert seconds_until(lambda: not any(board.speeds), "the stop") <= 0.6
    before = time.monotonic()  # how long the cable is out is what this test is about
    while time.monotonic() - before < outage:
        assert not any(board.speeds)
        time.sleep(0.02)
    machines.mend()
    again = seconds_until(lambda: any(board.speeds), "motion after the outage")
    print(f"{outage} s outage: drives again after {again:.2f} s")
    assert again <= 2.0
    twice = time.monotonic()
    while time.monotonic() - twice < 1.0:  # and does not stumble
        assert any(board.speeds)
        time.sleep(0.02)


def test_an_emergency_stop_pressed_during_the_outage_is_not_lost(machines):
    machines.cut()
    wait_for(lambda: not any(machines.board.speeds), "the stop")
    (machines.folder / "press").touch()
    time.sleep(3.0)  # the length of the outage
    machines.mend()
    wait_for(lambda: "emergency stop pressed" in (machines.folder / "robot.log").read_text(), "the emergency stop")
    wait_for(lambda: not any(machines.board.speeds), "the stop")
