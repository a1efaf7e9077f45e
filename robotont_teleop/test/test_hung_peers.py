"""The emergency stop while all peers of the robot's nodes hang: the board stands within 0.1 s, whoever hangs."""

import contextlib
import itertools
import os
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
import rospy
from geometry_msgs.msg import Twist
from roslib.packages import find_node
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from terminal import Terminal
from web_client import Client

from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_testing.harness import Master, free_port, suspended, wait_for
from robotont_testing.node_test import twist
from robotont_testing.stand_in_board import Board, speeds_of

pytestmark = [pytest.mark.timed, pytest.mark.alone]

WITHIN = 0.1  # [s]
PRESSES = 4   # each by one of several threads, any of which may hang
BY = ("page", "keys", "topic")
STAYS = 0.2   # [s] of zeros, after which a press by the keys is behind the zero that they send with it
PROGRAM = """import robotont_driver.rospy_repairs.quiet_interrupt
from robotont_teleop.hand import emergency_stop_publisher
emergency_stop_publisher.HELD = 0.0
from robotont_teleop.{} import main
main()"""  # a hand whose press can be released at once: else each of dozens would stand for a second


def hand(module):
    """The command of a node for driving by hand."""
    return "/usr/bin/python3", "-c", PROGRAM.format(module)


class Robot:
    """robot.launch on a stand-in board; a page, a terminal with keys, a button, and somebody who drives."""

    def __init__(self, processes, disk):
        self.processes = processes
        self.disk = disk  # of its own, which can be frozen, or None
        self.board = Board(str(processes.folder / "board"))
        self.board.plug()
        self._reader, self.pipe = os.pipe()  # nobody reads
        port, given = free_port(), {"ROS_LOG_DIR": str(disk)} if disk else {}
        self.launch = processes.launch("robot.launch", f"port:={self.board.link}", "description:=false",
                                       log=f"/dev/fd/{self.pipe}", **given)
        self.rosout = processes.start(*find_node("rosout", "rosout"), **given)
        self.command = rospy.Publisher("cmd_vel/default", Twist, queue_size=1, tcp_nodelay=True)
        self.button = rospy.Publisher("emergency_stop", Bool, queue_size=1, tcp_nodelay=True)
        wait_for(lambda: self.command.get_num_connections() and self.button.get_num_connections(), "the nodes",
                 timeout=60.0)
        self.server = processes.start(*hand("web.web_teleop_node"), f"_port:={port}", **given)
        self.listener = processes.start(*find_node("rosbag", "record"), "-q", "-a", "-O", processes.folder / "bag")
        self.client = Client(port).__enter__()
        self.page = self.client.awaited_page()
        self.keys = Terminal(program=hand("hand.keyboard_teleop"))
        wait_for(lambda: "robot" in self.keys.line, "the keys", timeout=60.0)
        rospy.wait_for_service("emergency_stop/release", 20.0)
        self._release = rospy.ServiceProxy("emergency_stop/release", Trigger, persistent=True)
        self._release()
        self.speed = 0.0  # [m/s] that somebody commands
        RepeatingThread(lambda: self.command.publish(twist(self.speed)) or 0.02)
        for by in BY:  # whoever hangs afterwards, each is connected
            self.release()
            self.delay(by)

    def close(self):
        self.speed = 0.0
        self.keys.end()
        self.client.__exit__()
        os.close(self._reader)  # whoever waits for room in it goes on
        os.close(self.pipe)
        with ThreadPoolExecutor() as ends:  # each takes a second
            list(ends.map(self.processes.stop, (self.server, self.listener, self.rosout, self.launch)))
        self.board.close()

    def release(self):
        """As a person does who asks again where he must; it moves behind a zero."""
        speeds = itertools.cycle((0.0, 0.2))

        def moves():
            if not any(self.board.speeds):
                self._ask()
                self.speed = next(speeds)
            return any(self.board.speeds)
        wait_for(moves, "motion", period=0.1)
        self.speed = 0.2

    def _ask(self):
        answers = []
        threading.Thread(target=lambda: answers.append(self._release()), daemon=True).start()
        return wait_for(lambda: answers, "an answer to the release")[0]

    def delay(self, by):
        """[s] from a press until the last wheel's zero is on the wire, to stay until the release."""
        first, pressed = len(self.board.heard), time.monotonic()
        {"page": lambda: self.page.send({"kind": "stop"}), "keys": lambda: self.keys.type(" "),
         "topic": lambda: self.button.publish(True)}[by]()

        def standing():
            heard = [(at, any(speeds_of(line.encode(), 3))) for at, line in self.board.heard[first:]]
            moved = max((at for at, moves in heard if moves), default=pressed)
            zeros = [at for at, _ in heard if at > moved]
            return zeros and zeros[-1] - moved > STAYS and zeros[0] - pressed
        return wait_for(standing, f"the stop by {by}")

    @contextlib.contextmanager
    def peers_hung(self):
        """A block during which all peers of the robot's nodes hang, and the disk, where there is one."""
        with contextlib.ExitStack() as stack:
            if self.disk:
                subprocess.run(["fsfreeze", "-f", str(self.disk)], check=True)
                stack.callback(subprocess.run, ["fsfreeze", "-u", str(self.disk)], check=True)
            os.set_blocking(self.pipe, False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.write(self.pipe, b"x")
            stack.callback(lambda: [os.read(self._reader, 4096) for _ in range(10)])
            for peer in (self.processes._master, self.launch, self.rosout, self.listener):
                stack.enter_context(suspended(peer.pid))
            yield


@pytest.fixture
def disk(tmp_path):
    """A disk of its own, which can be frozen; None where that is not allowed."""
    image, folder = tmp_path / "image", tmp_path / "disk"
    folder.mkdir()
    image.write_bytes(bytes(16 << 20))
    try:
        subprocess.run(["mkfs.ext4", "-q", str(image)], check=True)
        subprocess.run(["mount", "-o", "loop", str(image), str(folder)], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        yield None
        return
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)


@pytest.fixture
def robot(disk):
    with Master() as processes:
        rospy.init_node("hung_peers", anonymous=True, disable_signals=True)
        robot = Robot(processes, disk)
        yield robot
        robot.close()


def test_a_stop_waits_for_nobody(robot):
    robot.release()
    with robot.peers_hung():
        for by in BY * PRESSES:
            assert robot.delay(by) <= WITHIN, by
            robot.release()
