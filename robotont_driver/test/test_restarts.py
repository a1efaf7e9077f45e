"""Boards that restart unheard, lines lost and bytes spoilt: no motion that nobody made, unless it is told."""

import math
import random

import numpy as np
import pytest
from checked_bench import Sender
from protocol_bench import official_wheels

from robotont_boards.virtual_board import OfficialOdometry
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.connection import KINDS
from robotont_testing.stand_in_board import PERIOD, identity, sealed

EDGES_PER_METRE = 1200 / (2 * math.pi * 0.035)
MATRIX = np.array([(-math.sin(angle), math.cos(angle), 0.145) for angle in np.radians((60, 180, 300))])
METRES, RADIANS = 0.005, math.radians(0.5)  # a smaller error is none


class Robot:
    """The true motion: `pose` (x, y, yaw) and `edges` of each wheel; motors that follow within 0.1 s."""

    def __init__(self):
        self.pose, self.edges, self.twist = np.zeros((3, 3))

    def move(self, wanted):
        """One period with the motors set to a twist."""
        self.twist = self.twist + (np.array(wanted) - self.twist) * (1 - math.exp(-PERIOD / 0.1))
        self.pose = np.array(se2.compose(self.pose, se2.arc(self.twist * PERIOD)))
        self.edges = self.edges + MATRIX @ self.twist * PERIOD * EDGES_PER_METRE


class CheckedBoard:
    """This project's board: counts, counter, totals, status and CRC in every line."""

    banner = sealed(identity())

    def __init__(self, robot, chance):
        self._robot, self._chance = robot, chance
        self._sender = Sender(identity=identity())
        self.board = self._sender.board
        self.restart()
        self.board.counter = chance.randrange(256)

    def restart(self):
        self._counted = np.floor(self._robot.edges).astype(int)
        self.board.restart(start_totals=self._chance.choice((0, self._chance.randrange(65536))))

    def send(self):
        before, self._counted = self._counted, np.floor(self._robot.edges).astype(int)
        return self._sender.packet((self._counted - before).tolist())


class PoseBoard:
    """The official firmware's odometry and lines."""

    banner = b"**** MAIN ****\r\n"

    def __init__(self, robot, chance):
        self._robot = robot
        self._odometry = OfficialOdometry(0.145, math.sin, math.cos)
        self.restart()
        scale = chance.choice((0.1, 1.0))
        self._odometry.pose = np.array([chance.uniform(-limit, limit) * scale for limit in (1, 1, 4)], np.float32)

    def restart(self):
        self._before = np.floor(self._robot.edges)
        self._odometry.reset()

    def send(self):
        now = np.floor(self._robot.edges)
        self._odometry.update((now - self._before) / EDGES_PER_METRE / PERIOD)
        self._before = now
        return self._odometry.line(base_frame=True)


BOARDS = {"checked": CheckedBoard, "robotont2": PoseBoard}


class Drive:
    """One robot, its board, and the driver's protocol and odometry, which hear what `spoil` leaves of the lines."""

    def __init__(self, kind, seed):
        self.chance = random.Random(f"{kind} {seed}")
        self.robot = Robot()
        self.board = BOARDS[kind](self.robot, self.chance)
        self.protocol = KINDS[kind](official_wheels())
        self.odometry = WheelOdometry(Kinematics(official_wheels()), PERIOD, 1e-6)
        self.now = 0.0
        self.spoilt = 0.0    # part of the bytes
        self.lost = 0        # lines to come that are lost
        self.wanted = (0.0, 0.0, 0.0)

    def any_twist(self):
        speed, angle = self.chance.uniform(0, 0.25), self.chance.uniform(-math.pi, math.pi)
        return speed * math.cos(angle), speed * math.sin(angle), self.chance.choice((0.0, self.chance.uniform(-1, 1)))

    def run(self, periods, change=0.02):
        """Drive on; the twist that is wanted may change in each period."""
        for _ in range(periods):
            if self.chance.random() < change:
                self.wanted = self.any_twist()
            self.robot.move(self.wanted)
            self.now += PERIOD
            self.hear(self.board.send())

    def pause(self, periods):
        """The board is dead, and the robot rolls out."""
        for _ in range(periods):
            self.robot.move((0.0, 0.0, 0.0))
            self.now += PERIOD

    def hear(self, data):
        for line in data.splitlines(keepends=True):
            if self.lost:
                self.lost -= 1
                continue
            heard = bytes(self.chance.randrange(256) if self.chance.random() < self.spoilt else byte for byte in line)
            for counts in self.protocol.feed(heard, self.now + self.chance.uniform(0, 0.004)):
                self.odometry.update(counts, 0.0)

    def settle(self):
        self.wanted = (0.0, 0.0, 0.0)
        self.run(30, change=0.0)

    @property
    def off(self):
        """By what the odometry is wrong: (x [m], y [m], yaw [rad])."""
        pose = self.odometry.pose
        return np.subtract((pose.x, pose.y, pose.yaw), self.robot.pose)

    def assert_right_or_told(self):
        """No error that counts, unless the log says that there may be one."""
        x, y, yaw = self.off
        right = math.hypot(x, y) <= METRES and abs(se2.wrap(yaw)) <= RADIANS
        assert right or self.protocol.restarts or self.protocol.doubts


def restarted(kind, seed):
    """A drive in which the board restarts."""
    drive = Drive(kind, seed)
    chance = drive.chance
    drive.run(10, change=0.0)
    drive.wanted = drive.any_twist()
    drive.run(chance.randrange(5, 60))
    drive.spoilt = chance.choice((0.0, 0.01))
    drive.lost = chance.choice((0, 0, chance.randrange(3)))
    drive.run(2)
    drive.board.restart()
    drive.lost = 0
    drive.pause(chance.choice((0, 0, chance.randrange(15), chance.randrange(100))))
    if chance.random() < 0.5:
        drive.hear(drive.board.banner)
    drive.lost = chance.randrange(6)
    drive.wanted = chance.choice((drive.wanted, (0.0, 0.0, 0.0), drive.any_twist()))
    drive.run(25)
    drive.spoilt = 0.0
    drive.settle()
    return drive


@pytest.mark.parametrize("kind", BOARDS)
def test_no_restart_moves_the_robot_unless_it_is_told(kind):
    told = 0
    for seed in range(100):
        drive = restarted(kind, seed)
        told += drive.protocol.restarts
        drive.assert_right_or_told()
    print(f"{kind}: 100 restarts, {told} told, no pose moved by more than {1000 * METRES:g} mm untold")
    assert 75 < told < 104  # a spoilt line may be taken for one more


@pytest.mark.parametrize("kind", BOARDS)
def test_lost_lines_and_spoilt_bytes_are_no_restart(kind):
    restarts = 0
    for seed in range(25):
        drive = Drive(kind, seed)
        drive.run(10, change=0.0)
        drive.spoilt = 0.005
        for _ in range(4):
            drive.wanted = drive.any_twist()
            drive.run(15)
            drive.lost = drive.chance.randrange(6)
        drive.spoilt, drive.lost = 0.0, 0
        drive.settle()
        restarts += drive.protocol.restarts
        # near the board's origin three good lines after many bad ones may well be those of a restart
        drive.assert_right_or_told()
    assert restarts <= (0 if kind == "checked" else 2)


@pytest.mark.parametrize("lost", [85, 90, 95])
def test_a_counter_that_starts_anew_at_once_is_no_gap_of_periods_for_which_there_was_no_time(lost):
    drive = Drive("checked", lost)
    board = drive.board.board
    board.counter, board.offset = (-lost - 201) % 256, 3000
    drive.wanted = (0.2, 0.0, 0.0)
    drive.run(200, change=0.0)
    before = drive.off
    drive.board.restart()
    board.offset = 0
    drive.run(30, change=0.0)
    assert (drive.protocol.restarts, drive.protocol.repaired) == (1, 0)
    assert np.abs(drive.off - before).max() < 0.001
