"""Launches of robots one behind the other on one master: what each sets, and how each drives."""

import os
import re
import signal
import xmlrpc.client

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from roslaunch.config import load_config_default
from roslaunch.launch import ROSLaunchRunner
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from robotont_boards import BOARDS
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_simulator import simulator_node
from robotont_testing import places
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import START, free_port, wait_for
from robotont_testing.stand_in_board import Board

NAMES = ("thesis", "robotont2", "robotont3", "four_wheels")
OFFICIAL = str(places.package("robotont_driver") / "launch" / "driver_basic.launch")
LAUNCHES = {
    **{name: ("robot.launch", f"robot:={name}", "description:=false") for name in NAMES},
    **{name + " in three": ("robot.launch", f"robot:={name}", "description:=false", "composed:=false")
       for name in ("robotont2",)},
    **{"simulated " + name: ("simulation.launch", f"robot:={name}", "description:=false") for name in NAMES},
    "driver_basic": ("driver_basic.launch",),
    "commands": ("odometry_from_commands.launch",),
    "tuned": ("robot.launch", "robot:=robotont2", "publish_tf:=false", "imu:=imu", "description:=false"),
    "official": (OFFICIAL,),
}
TWISTS = ((0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.5))
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


class Parameters:
    """What launch files set on a master, without starting anything."""

    def __init__(self, master):
        self._uri = master.uri
        self._server = xmlrpc.client.ServerProxy(master.uri)
        self._configurations = {name: load_config_default([(str(places.launch(file)), arguments)], None)
                                for name, (file, *arguments) in LAUNCHES.items()}

    def forget(self):
        """All parameters, as a new master."""
        for key in set(self._server.getParam("/test", "/")[2]) - {"run_id"}:
            self._server.deleteParam("/test", "/" + key)

    def load(self, name):
        """What the nodes of a launch read behind it."""
        configured = self._configurations[name]
        configured.master.uri = self._uri
        ROSLaunchRunner("test", configured)._load_parameters()
        return seen(self._server.getParam("/test", "/")[2], {node.name for node in configured.nodes})

    def alone(self, name):
        """The same on a fresh master."""
        self.forget()
        return self.load(name)


class Rig:
    """Launches robots one after the other on one master, drives each, and looks at what comes out."""

    def __init__(self, master):
        self.master = master
        self.link = str(master.folder / "board")
        self.written, self.odom, self.joints = [], [], []
        rospy.init_node("rig", disable_signals=True)
        rospy.Subscriber("serial_write", String, self.written.append, tcp_nodelay=True)
        rospy.Subscriber("odom", Odometry, self.odom.append, tcp_nodelay=True)
        rospy.Subscriber("joint_states", JointState, self.joints.append, tcp_nodelay=True)
        self.command = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def start(self, name):
        """Start it with its board; waits for odometry."""
        self.board = self._board(name)
        if self.board:
            self.board.plug()
        file, *arguments = LAUNCHES[name]
        self.odom.clear()
        self.log = self.master.folder / "log"
        self.launch = self.master.launch(file, f"port:={self.link}", *arguments, log=self.log)
        wait_for(lambda: self.odom, f"odometry of {name}", START)

    def _board(self, name):
        robot = name.replace(" in three", "")
        if robot in ("robotont2", "robotont3"):
            return BoardPort(self.link, lambda now: BOARDS[robot](Motors(), start=now))
        if name in ("thesis", "driver_basic", "four_wheels"):
            return Board(self.link, 4 if name == "four_wheels" else 3)
        return None

    def drive(self):
        """What three twists become: numbers on serial_write and on the wire; and the names of frames and joints."""
        found = []
        for x, y, turn in TWISTS:
            twist = Twist()
            twist.linear.x, twist.linear.y, twist.angular.z = x, y, turn
            self.written.clear()

            def driven(twist=twist, wanted=(x, y, turn)):
                self.command.publish(twist)
                measured = self.odom[-1].twist.twist
                measured = measured.linear.x, measured.linear.y, measured.angular.z
                return len(self.written) > 10 and np.allclose(measured, wanted, atol=0.05) and np.allclose(
                    numbers(self.written[-1].data), numbers(self.written[-8].data), atol=0.02)  # behind the ramp
            wait_for(driven, f"the robot to drive {x, y, turn}", period=0.03)
            found += [numbers(self.written[-1].data), numbers(self._wire())]
        return found, self.odom[-1].header.frame_id, self.odom[-1].child_frame_id, tuple(self.joints[-1].name)

    def _wire(self):
        """The newest line of speeds that the board heard; empty without one."""
        heard = self.board.heard if self.board else ()
        lines = [line if isinstance(line, str) else line.decode() for _, line in heard]
        return next((line.partition(";")[0] for line in reversed(lines) if "." in line), "")

    def stop(self):
        """End the robot and its board."""
        self.master.stop(self.launch)
        if self.board:
            self.board.unplug()

    def behaviour(self, name, between=lambda: None):
        """Start, drive and end it. between(): called before the drive."""
        self.start(name)
        between()
        found = self.drive()
        self.stop()
        return found

    def kill_driver(self):
        """Kill robotont_node, which is started again."""
        os.kill(self.master.pid("/driver_node"), signal.SIGKILL)
        self.odom.clear()
        wait_for(lambda: self.odom, "odometry of the new process", START)

    def join(self):
        """Start and end the page beside the robot: it joins, and may set nothing of the robot."""
        log = self.master.folder / "teleop.log"
        page = self.master.launch("teleop.launch", f"web_port:={free_port()}", log=log)
        wait_for(lambda: "drive the robot in a browser" in log.read_text(), "the page", START)
        self.master.stop(page)


def numbers(text):
    """All decimals in a text."""
    return [float(number) for number in re.findall(r"-?\d+\.\d+", text)]


def assert_same(found, wanted, name):
    """The same numbers but for rounding, the same names."""
    assert found[1:] == wanted[1:], name
    for one, other in zip(found[0], wanted[0]):
        assert len(one) == len(other), (name, found, wanted)
        assert np.allclose(one, other, atol=0.02), (name, found, wanted)
