"""Commands that waited on their way, and those from long ago, move nothing when the way is free again.

A robot and its commanders, on two machines. Where one that drove is killed, hung or cut off, each motion is an old one.
"""

import os
import signal
import subprocess
import time

import pytest

from robotont_testing import places
from robotont_testing.harness import suspend, wait_for
from robotont_testing.stand_in_board import Board, speeds_of
from robotont_testing.two_machines import TwoMachines

pytestmark = pytest.mark.timed
LATE = 1.0   # [s] besides the length of an outage, within which TCP brings what waited

# Drives at 20 Hz, or commands once, by a publisher that latches.
COMMANDER = """
import sys, time, rospy
from geometry_msgs.msg import Twist
rospy.init_node("commander", anonymous=True, disable_signals=True)
class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, *_):
        print("connected", flush=True)
once, motion = sys.argv[1] == "once", Twist()
publisher = rospy.Publisher("cmd_vel/hand", Twist, Listener(), tcp_nodelay=True, latch=once, queue_size=1)
motion.linear.x = 0.1
while True:
    publisher.publish(motion)
    time.sleep(1e9 if once else 0.05)
"""


class Stage(TwoMachines):
    """robot.launch and a ROS master on the robot, a board at its port, and commanders, by name, on the laptop."""

    def __init__(self):
        super().__init__()
        self.board = Board(str(self.folder / "board"), checked=True)
        self.board.plug()
        self._read = 0
        self.commanders = {}
        self.robot = self.on("robot", "roslaunch", places.launch("robot.launch"), f"port:={self.board.link}",
                             "description:=false", log=self.folder / "robot.log", **self.environment("robot"))
        wait_for(lambda: self.pid("driver_node"), "the robot", timeout=60)

    def close(self):
        self.board.close()
        super().close()

    def pid(self, name):
        """Process id of a process of robot.launch by its program's name; 0: it does not run now."""
        found = subprocess.run(["pgrep", "--parent", str(self.robot.pid), "--full", f"/{name}( |$)"], check=False,
                               text=True, stdout=subprocess.PIPE).stdout.split()
        return int(found[0]) if found else 0

    def command(self, who, how):
        """Let a commander "drive", or command "once"."""
        self.commanders[who] = self.on("laptop", "/usr/bin/python3", "-c", COMMANDER, how,
                                       log=self.folder / f"{who}.log", **self.environment("laptop"))

    def connections(self):
        """How often subscribers have connected to the publisher that latches."""
        return (self.folder / "latched.log").read_text().count("connected")

    def kill(self, who):
        self.stop(self.commanders.pop(who), signal.SIGKILL)

    def motions(self):
        """Lines of motion that the board has heard since the last call."""
        heard = self.board.heard[self._read:]
        self._read += len(heard)
        return [line for _, line in heard if any(speeds_of(line.encode(), 3) or ())]

    def stands(self):
        wait_for(lambda: not any(self.board.speeds), "the stop")
        self.motions()

    def stays(self, seconds):
        """It stands on. For how long it does, is what these tests are about."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            assert self.motions() == []
            time.sleep(0.02)

    def drives(self, who="driver"):
        """A commander drives it, as the robot is not deaf."""
        self.command(who, "drive")
        wait_for(self.motions, f"motion by the {who}", 60.0)

    def drives_by_another(self):
        self.drives("other")
        self.kill("other")
        self.stands()


@pytest.fixture(scope="module")
def both():
    with Stage() as both:
        yield both


@pytest.fixture
def stage(both):
    """The robot stands, and nobody commands it; afterwards, too, with nothing between the machines."""
    yield both
    for who in list(both.commanders):
        both.kill(who)
    both.mend()
    both.stands()


def test_what_waited_for_the_network_does_not_drive(stage):
    outage = 2.0  # [s]
    stage.drives()
    stage.cut(carrier=True)
    cut = time.monotonic()
    stage.stands()
    assert time.monotonic() - cut <= 0.6
    suspend(stage.commanders["driver"].pid)
    stage.stays(cut + outage - time.monotonic())
    stage.mend()
    stage.stays(outage + LATE)
    stage.drives_by_another()


def test_a_latched_command_drives_neither_after_an_outage_nor_a_node_that_was_killed(stage):
    stage.command("latched", "once")
    wait_for(stage.connections, "the connection")
    time.sleep(1.0)  # the command's age
    stage.stands()
    before = stage.connections()
    stage.cut(carrier=True)
    stage.stays(3.2)  # long enough to be noticed
    stage.mend()
    wait_for(lambda: stage.connections() > before, "the new connection")
    stage.stays(LATE)
    stage.drives_by_another()
    before = stage.connections()
    os.kill(stage.pid("cmd_vel_mux"), signal.SIGKILL)
    wait_for(lambda: stage.connections() > before, "the connection of the new node")
    stage.stays(LATE)
    stage.drives_by_another()
