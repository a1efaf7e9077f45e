"""Robotont's boards as delivered: the stand-ins, and the makers' own firmware where it lies beside the repository.

ROBOTONT_FIRMWARE=FOLDER ./robotont test -s robotont_driver/test/test_delivered_boards.py -m "long or not long"
prints the table.
"""

import math
import random
from functools import partial

import numpy as np
import pytest
from protocol_bench import Bench, official_wheels

from robotont_boards import BOARDS, POSITIONS
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.connection import KINDS, Connection
from robotont_driver.protocol.official_boards import OLD
from robotont_testing.dc_motors import Motors
from robotont_testing.makers_firmware import REFUSED, VERSIONS, CompiledBoard, library

USB_IDS = {"robotont2": "0483:374b", "robotont3": "0483:5740"}
FASTEST = {"robotont2": 0.25, "robotont3": 0.3}  # [m/s]
INVERSE = np.linalg.inv([(-math.sin(phi), math.cos(phi), 0.145) for phi in POSITIONS])
REST = (0.0, 0.0, 0.0)
RESTARTS = 10


class RobotMotors(Motors):
    """`pose`: where the wheels have really taken the robot."""

    pose = REST

    def turn(self, efforts, seconds):
        before = list(self.paths)
        counts = super().turn(efforts, seconds)
        self.pose = se2.compose(self.pose, se2.arc(INVERSE @ np.subtract(self.paths, before)))
        return counts


def subjects():
    """Parameters (protocol, board) of the tests: each stand-in, each version of the firmware that is there."""
    for kind, board in BOARDS.items():
        yield pytest.param(kind, board, id=f"stand-in of {kind}")
    for version, (kind, commit) in VERSIONS.items():
        yield compiled(version, commit, kind)


def compiled(version, commit, *more):
    """Parameters (*more, board) of a test with the firmware of a commit, skipped where it is not there."""
    path, missing = library(commit)
    return pytest.param(*more, partial(CompiledBoard, path), id=f"firmware {version}",
                        marks=pytest.mark.skipif(bool(missing), reason=missing))


each_board = pytest.mark.parametrize("kind, board", list(subjects()))


class Drive:
    """A robot that is driven at random; `heard`: [(s, bytes)] that its board has sent."""

    def __init__(self, kind, board, seed):
        self.kind, self._board = kind, board
        self.bench = Bench(kind, RobotMotors(), board)
        self.heard = []
        self.chance = random.Random(seed)
        self.bench.pass_on = lambda data: self.heard.append((self.bench.now, data)) if data else None

    def run(self, seconds):
        """Random twists, then rest."""
        end = self.bench.now + seconds
        while self.bench.now < end:
            speed, angle = self.chance.uniform(0, FASTEST[self.kind]), self.chance.uniform(-math.pi, math.pi)
            turn = self.chance.choice((0, self.chance.uniform(-1, 1)))
            self.bench.hold((speed * math.cos(angle), speed * math.sin(angle), turn), self.chance.uniform(0.2, 2.0))

    def restart(self, pause):
        """The board is dead for a time; (where the robot was before, and after)."""
        before = self.bench.motors.pose
        for _ in range(round(pause * 1000)):
            self.bench.motors.turn(REST, 0.001)
        self.bench.now += pause
        self.bench.board = self._board(self.bench.motors, start=self.bench.now)
        return before, self.bench.motors.pose

    @property
    def pose(self):
        """Where the robot really is."""
        return self.bench.motors.pose


class Listener:
    """The driver's protocol and odometry on what a board has sent, less what the line spoils.

    lost: part of the lines; spoilt: of the bytes; late: [s] at most; stall: [s] for which the PC stands each 7 s.
    """

    def __init__(self, kind, heard, lost=0.0, spoilt=0.0, late=0.001, stall=0.0):
        chance = random.Random(2)
        self.protocol = KINDS[kind](official_wheels())
        self.odometry = WheelOdometry(Kinematics(official_wheels()), 0.02, 0.005)
        rest, until = b"", 0.0
        for at, data in heard:
            *lines, rest = (rest + data).split(b"\n")
            kept = b"".join(line + b"\n" for line in lines if chance.random() >= lost)
            kept = bytes(chance.randrange(256) if chance.random() < spoilt else byte for byte in kept)
            until = at + stall if stall and at % 7.0 < 0.02 else until
            for packet in self.protocol.feed(kept, max(until, at + chance.uniform(0, late))):
                self.odometry.update(packet, 0.0)

    @property
    def pose(self):
        return self.odometry.pose.x, self.odometry.pose.y, self.odometry.pose.yaw


def off(pose, other):
    """(mm, degrees) between two poses."""
    return (1000 * math.hypot(pose[0] - other[0], pose[1] - other[1]),
            math.degrees(abs(se2.wrap(pose[2] - other[2]))))


def own_pose(heard):
    """The newest pose that the board has sent."""
    lines = [line for line in b"".join(data for _, data in heard).split(b"\r\n") if line.startswith(b"ODOM")]
    return [float(field) for field in lines[-1].split(b":")[1:4]]


@each_board
def test_it_is_recognised_and_drives_the_way_that_was_asked(kind, board):
    drive = Drive(kind, board, 0)
    connection = Connection(official_wheels(), "auto", USB_IDS[kind])
    for axis in range(3):
        start = drive.pose
        drive.bench.hold([0.2 * (axis == way) for way in range(3)], 1.5)
        drive.bench.hold(REST, 0.5)
        moved = se2.between(start, drive.pose)
        assert moved[axis] == pytest.approx(0.3, rel=0.15)
        assert sum(map(abs, moved)) == pytest.approx(moved[axis], abs=0.05)
    known = next(at for at, data in drive.heard if connection.feed(data, at) or connection.protocol)
    assert connection.protocol.name == kind
    assert known <= 2.0
    print(f"{known:.2f} s", end=" ")


@each_board
def test_it_stops_by_itself_as_long_after_the_last_line_as_the_pages_say(kind, board):
    bench = Drive(kind, board, 0).bench
    bench.hold((0.0, 0.2, 0.0), 2.0)
    bench.fall_silent()
    fast = max(map(abs, bench.motors.speeds))
    while max(map(abs, bench.motors.speeds)) > fast / 2:
        bench.run(0.01)
        assert bench.now < 4.0
    assert 1.0 <= bench.now - bench.sent[-1][0] <= 1.2


@pytest.mark.parametrize("board", [compiled(*each) for each in REFUSED.items()])
def test_firmware_from_before_march_2020_is_refused_by_name(board):
    drive = Drive("robotont2", board, 5)
    drive.bench.pass_on = lambda data: data
    drive.run(3.0)
    drive.bench.fall_silent()
    drive.bench.run(1.0)
    assert drive.bench.protocol.obstacle == OLD
    assert drive.bench.motors.speeds == pytest.approx([0.0] * 3)
    assert math.hypot(*drive.pose[:2]) < 0.1
    print(f"{1000 * math.hypot(*drive.pose[:2]):.0f} mm", end=" ")


@each_board
def test_restarts_are_heard_and_the_odometry_goes_on(kind, board):
    drive = Drive(kind, board, 3)
    expected = start = REST
    for _ in range(RESTARTS):
        drive.run(drive.chance.uniform(1.0, 3.0))
        before, after = drive.restart(round(drive.chance.uniform(0.05, 1.0), 3))
        expected, start = se2.compose(expected, se2.between(start, before)), after
    drive.run(1.0)
    drive.bench.hold(REST, 1.0)
    expected = se2.compose(expected, se2.between(start, drive.pose))
    for line in ({}, {"late": 0.003}, {"stall": 0.5}):
        listener = Listener(kind, drive.heard, **line)
        assert listener.protocol.restarts == RESTARTS
        assert off(listener.pose, expected)[0] < 5 * RESTARTS  # what the wheels made in the periods that broke off


@pytest.mark.parametrize("seeds, seconds", [(1, 20), pytest.param(5, 60, marks=pytest.mark.long)])
@each_board
def test_random_driving(kind, board, seeds, seconds):
    for seed in range(seeds):
        drive = Drive(kind, board, seed)
        drive.run(seconds)
        drive.bench.hold(REST, 1.0)
        listener = Listener(kind, drive.heard)
        (way, angle), own = off(listener.pose, drive.pose), off(own_pose(drive.heard), drive.pose)
        lost, spoilt, stall = (off(Listener(kind, drive.heard, **line).pose, listener.pose)[0]
                               for line in ({"lost": 0.2}, {"spoilt": 0.001}, {"stall": 0.5}))
        print(f"\n{kind}, seed {seed}: {way:.1f} mm {angle:.2f} deg, own pose {own[0]:.1f} mm {own[1]:.2f} deg; "
              f"20 % lost {lost:.1f} mm, 0.1 % spoilt {spoilt:.1f} mm, stalls {stall:.1f} mm")
        assert (listener.protocol.dropped, listener.protocol.restarts) == ({}, 0)
        if kind == "robotont3":
            assert way <= 15.0
            assert angle <= 0.5
        else:
            assert way <= 1.2 * own[0]
            assert angle <= 1.2 * own[1]
        assert max(lost, spoilt, stall) <= 2.0
