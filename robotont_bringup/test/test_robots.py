"""What a launch sets replaces all that earlier ones left, whatever their robots were, on one master."""

import os
import re
import signal
import xmlrpc.client
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from roslaunch.config import load_config_default
from roslaunch.launch import ROSLaunchRunner
from sensor_msgs.msg import JointState

from robotont_boards import Robotont2Board
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.robots.robot_folder import shipped
from robotont_simulator import simulator_node
from robotont_testing import places
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import START, Master, free_port, in_own_process, wait_for
from robotont_testing.node_test import twist
from robotont_testing.stand_in_board import Board

NAMES = ("thesis", "robotont2", "robotont3", "four_wheels")
LAUNCHES = {
    **{name: ("robot.launch", f"robot:={name}", "description:=false") for name in NAMES},
    "in three": ("robot.launch", "robot:=robotont2", "description:=false", "composed:=false"),
    "simulated": ("simulation.launch", "robot:=four_wheels", "description:=false"),
    "driver_basic": ("driver_basic.launch",),
    "commands": ("odometry_from_commands.launch",),
    "tuned": ("robot.launch", "robot:=robotont2", "publish_tf:=false", "imu:=imu", "description:=false"),
}
OFFICIAL = (str(places.package("robotont_driver") / "launch" / "driver_basic.launch"),)  # leaves names of its own
TABLES = {"driver_node": driver_node, "serial_com_node": serial_com_node, "odom_node": odom_node,
          "simulator_node": simulator_node}


def seen(parameters, nodes):
    """What the nodes read of a master's parameters: the wheels, and theirs by node and name, official ones included."""
    found = {"wheels": read_wheels(parameters), "robot": parameters.get("robot"), "battery": parameters.get("battery")}
    composed = "robotont_node" in nodes
    for node in {*nodes, *(("driver_node", "serial_com_node", "odom_node") if composed else ())} & set(TABLES):
        own = parameters.get(node, {})
        for parameter in TABLES[node].PARAMETERS:
            place, _, name = parameter.official.partition("/")
            default = parameters.get(place, {}).get(name, parameter.default)
            found[node, parameter.name] = repr(own.get(parameter.name, default))  # nan is not equal to itself
    return found


def test_parameters_of_each_launch_behind_all_others_are_those_on_a_fresh_master():
    """Forward and backward, so that each stands before and behind each other one."""
    configurations = {name: load_config_default([(str(places.launch(file)), arguments)], None)
                      for name, (file, *arguments) in {**LAUNCHES, "official": OFFICIAL}.items()}
    with Master() as master:
        server = xmlrpc.client.ServerProxy(master.uri)

        def load(name):
            configured = configurations[name]
            configured.master.uri = master.uri
            ROSLaunchRunner("test", configured)._load_parameters()
            return seen(server.getParam("/test", "/")[2], {node.name for node in configured.nodes})

        fresh = {}
        for name in LAUNCHES:
            for key in server.getParam("/test", "/")[2]:
                server.deleteParam("/test", "/" + key)
            fresh[name] = load(name)
        load("official")
        for name in (*LAUNCHES, *reversed(LAUNCHES)):
            assert load(name) == fresh[name], name


class Rig:
    """Launches robots one after the other on one master, drives each, and looks at what comes out."""

    def __init__(self, master):
        self.master = master
        self.odom, self.joints = [], []
        rospy.init_node("rig", disable_signals=True)
        rospy.Subscriber("odom", Odometry, self.odom.append, tcp_nodelay=True)
        rospy.Subscriber("joint_states", JointState, self.joints.append, tcp_nodelay=True)
        self.command = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def behaviour(self, name, board, between=lambda: None):
        """Numbers on the wire for two twists, and the names of frames and joints; between(): before the drive."""
        board.plug()
        self.odom.clear()
        launch = self.master.launch(*LAUNCHES[name], f"port:={board.link}")
        wait_for(lambda: self.odom, f"odometry of {name}", START)
        between()
        found = []
        for wanted in ((0.0, 0.2, 0.0), (0.2, 0.0, 0.3)):
            def driven(wanted=wanted):
                self.command.publish(twist(*wanted))
                measured = self.odom[-1].twist.twist if self.odom else Twist()
                return np.allclose((measured.linear.x, measured.linear.y, measured.angular.z), wanted, atol=0.05)
            wait_for(driven, f"the robot to drive {wanted}", period=0.03)
            heard = b"".join(line if isinstance(line, bytes) else line.encode() + b"\n" for _, line in board.heard)
            lines = [line.partition(b";")[0] for line in heard.splitlines()]
            line = next(line for line in reversed(lines) if b"." in line and re.search(b"[1-9]", line))
            found += map(float, re.findall(rb"-?\d+\.\d+", line))
        self.master.stop(launch)
        board.unplug()
        return found, self.odom[-1].header.frame_id, self.odom[-1].child_frame_id, tuple(self.joints[-1].name)

    def disturb(self):
        """The page joins the robot and goes, and may set nothing of it; the driver is killed, and started again."""
        log = self.master.folder / "teleop.log"
        page = self.master.launch("teleop.launch", f"web_port:={free_port()}", log=log)
        wait_for(lambda: "drive the robot in a browser" in log.read_text(), "the page", START)
        self.master.stop(page)
        os.kill(self.master.pid("/driver_node"), signal.SIGKILL)
        self.odom.clear()
        wait_for(lambda: self.odom, "odometry of the new process", START)


@in_own_process
def test_a_robot_drives_behind_another_one_as_alone():
    with Master() as master:
        rig, link = Rig(master), str(master.folder / "board")

        def drive(between=lambda: None):
            return rig.behaviour("robotont2", BoardPort(link, lambda now: Robotont2Board(Motors(), start=now)), between)
        alone = drive()
        rig.behaviour("four_wheels", Board(link, 4))
        behind = drive(rig.disturb)
        assert behind[1:] == alone[1:]
        np.testing.assert_allclose(behind[0], alone[0], atol=0.02)


def test_the_page_about_robots_has_every_robot():
    page = (Path(__file__).resolve().parents[2] / "docs" / "robots.md").read_text()
    assert all(f"`{folder.name}`" in page for folder in shipped().iterdir())
