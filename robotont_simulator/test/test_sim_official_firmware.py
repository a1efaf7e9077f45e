"""The official firmware on the simulated robot, driven through the protocols, on the simulator's own clock."""

import math

import pytest

from robotont_boards import BOARDS
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.link.serial_link import Outbox
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.connection import KINDS
from robotont_driver.protocol.plain import parse_packet
from robotont_driver.protocol.protocol import format_packet
from robotont_simulator.simulated_board import make_simulation
from robotont_simulator.world import World
from robotont_testing.robots import ROBOTONT2, SHIPPED

FLOOR = World()
LOOKS = 8  # at the line, per period: lines are read when they come
PERIOD = 0.02  # [s]


class Drive:
    """A PC and a board with the official firmware on a simulated robot."""

    def __init__(self, name, mass=None):
        """mass: [kg], as by the wheels' file where None."""
        wheels = read_wheels(ROBOTONT2)
        self.simulation = make_simulation(name, wheels._replace(mass=mass or wheels.mass), FLOOR, 1)
        self.board = BOARDS[name](self.simulation)
        self.kinematics = Kinematics(wheels)
        self.odometry = WheelOdometry(self.kinematics, PERIOD, 0.008)
        self.protocol = KINDS[name](wheels)
        self.outbox = Outbox()
        self.outbox.pacing = self.protocol.pacing
        self.now = 0.0

    def hold(self, twist, seconds):
        """Command a twist at 50 Hz."""
        text = format_packet(self.kinematics.units_of_twist(twist), 3)
        for _ in range(round(seconds / PERIOD)):
            self.outbox.put(self.protocol.encode(parse_packet(text, 3)))
            line = self.outbox.take(self.now + PERIOD)
            if line:
                self.board.receive(line, self.now + PERIOD)
            for _ in range(LOOKS):
                self.now += PERIOD / LOOKS
                for counts in self.protocol.feed(self.board.advance(self.now), self.now):
                    self.odometry.update(counts, PERIOD)

    def errors(self):
        """Distance [m] and angle [rad] to the truth: of this driver's odometry, and of the board's own pose."""
        x, y, yaw = self.simulation.pose()
        pose, reported = self.odometry.pose, map(float, self.board.odometry.pose)
        return [(math.hypot(a - x, b - y), abs(math.remainder(c - yaw, 2 * math.pi)))
                for a, b, c in ((pose.x, pose.y, pose.yaw), reported)]


@pytest.mark.parametrize("name", ["robotont2", "robotont3"])
def test_a_square_and_a_turning_circle_against_the_truth(name):
    drive = Drive(name)
    drive.hold((0, 0, 0), 1.0)
    for x, y in ((0.2, 0), (0, 0.2), (-0.2, 0), (0, -0.2)):
        drive.hold((x, y, 0), 2.5)
    drive.hold((0, 0, 0), 1.5)
    square = drive.errors()
    turn = 2 * math.pi / 7.5
    for step in range(375):
        angle = 2 * turn * step * PERIOD
        drive.hold((0.1 * math.cos(angle), 0.1 * math.sin(angle), -turn), PERIOD)
    drive.hold((0, 0, 0), 1.5)
    circle = drive.errors()
    print(name, [[f"{1000 * metres:.1f} mm {math.degrees(radians):.2f} deg" for metres, radians in errors]
                 for errors in (square, circle)])
    for ours, boards in (square, circle):
        assert ours[0] < 0.03
        assert ours[1] < math.radians(3)
        assert ours[0] < boards[0] + 0.002  # never worse than the official algorithm on the same bytes
    assert drive.board.swallowed == []
    assert drive.board.inversions == 0


def test_the_official_board_needs_its_own_wheels():
    with pytest.raises(ValueError, match="robot:=robotont2"):
        make_simulation("robotont2", read_wheels(SHIPPED), FLOOR, 0)
