"""Minutes of driving over a bad line, on a virtual clock: PC and firmware, no physics, every count known."""

import random

import numpy as np
import pytest

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.motor import counts_in_reach
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.protocol.dialects import make_dialect
from robotont_driver.protocol.packet import format_packet, parse_packet
from robotont_firmware.main_loop import Controller
from robotont_simulator.simulated_board import SimulatedBoard, configuration
from robotont_testing.dc_motors import Motors
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import Line

PERIOD = 0.02   # [s]
CORRUPT = 0.01  # of the bytes
REPEAT = 2      # [periods] between two commands
HOLD = 100      # [periods] for which a twist is commanded


class Body:
    """Motors without a robot, in the simulation's place. `true`: all counts of each wheel."""

    def __init__(self, wheels):
        self.wheels = wheels
        self.voltage = 12.0
        self.true = np.zeros(wheels.amount, dtype=int)
        self._motors = Motors(wheels.amount)
        self._efforts = [0.0] * wheels.amount

    def step(self):
        self.true += self._motors.turn(self._efforts, PERIOD)

    def counts(self):
        return self.true % 0x10000

    def drive(self, wheel, effort):
        self._efforts[wheel] = effort


class Drive:
    """A PC and a board, and a line that corrupts a share of the bytes in both directions."""

    def __init__(self, corrupt):
        self.wheels = read_wheels(SHIPPED)
        self.body = Body(self.wheels)
        self.kinematics = Kinematics(self.wheels)
        self.odometry, self.truth = (WheelOdometry(self.kinematics, PERIOD, 0.005) for _ in range(2))
        self.dialect = make_dialect("auto", self.wheels, counts_in_reach(self.wheels))
        self.to_board, self.to_pc = Line(1), Line(2)
        self.to_board.corrupt = self.to_pc.corrupt = corrupt
        self.published = np.zeros(3, dtype=int)
        self.counts = []            # published, of each period
        self.true = []              # total counts of each wheel, after each period
        self.commands = {(0, 0, 0)}  # that were sent [1/256 unit]
        self.obeyed = self.wrong_commands = self.wrong_packets = 0
        self._to_board = bytearray()
        self._board = SimulatedBoard(self.body, self, lambda: True, real_time=False)
        self._controller = Controller(self._board, configuration(self.wheels, 3.6, 0.043), 3, "simulated")
        self._controller.start()

    @property
    def now(self):
        return len(self.true) * PERIOD

    def read(self, size):
        """The board reads."""
        data, self._to_board = self._to_board[:size], self._to_board[size:]
        return bytes(data)

    def write(self, data):
        """The board writes: what the PC publishes must add up to what the wheels have turned."""
        packets = [counts for piece in self.to_pc.pass_on(data) for counts in self.dialect.feed(piece, self.now)]
        for counts in packets:
            self.published += counts
            self.odometry.update(counts, 0.0)
        self.counts += packets
        self.wrong_packets += bool(packets) and tuple(self.published) != tuple(self.body.true)

    def command(self, twist):
        packet = parse_packet(format_packet(self.kinematics.units_of_twist(twist), 2), 3)
        self.commands.add(tuple(map(fixed_point, packet)))
        self._to_board += b"".join(self.to_board.pass_on(self.dialect.spoken.encode(packet)))

    def run(self, seconds, twists):
        receiver = self._controller._receiver
        for period in range(round(seconds / PERIOD)):
            if period % REPEAT == 0:
                self.command(twists[period // HOLD % len(twists)])
            before = list(self.body.true)
            obeyed = receiver.setpoints
            self._controller.step(self._board.wait_tick())
            self.obeyed += receiver.setpoints is not obeyed
            self.wrong_commands += tuple(receiver.setpoints) not in self.commands
            self.truth.update([after - count for after, count in zip(self.body.true, before)], 0.0)
            self.true.append(tuple(self.body.true))


def fixed_point(unit):
    """A command [units] as the firmware keeps it [1/256 unit], rounded to nearest."""
    hundredths = round(abs(unit) * 100)
    return (hundredths * 512 + 100) // 200 * (1 if unit >= 0 else -1)


def random_twists(seed):
    generator = random.Random(seed)
    return [(generator.uniform(-0.4, 0.4), generator.uniform(-0.4, 0.4), generator.uniform(-1, 1))
            for _ in range(40)] + [(0.0, 0.0, 0.0)]


@pytest.mark.parametrize("seconds", [60.0, pytest.param(600.0, marks=pytest.mark.long)])
def test_no_count_is_lost_and_no_wrong_packet_obeyed_at_one_percent_of_corrupted_bytes(seconds):
    """The turn is exact. A repaired period has its share of the counts, not its own: that moves the path a little."""
    drive = Drive(CORRUPT)
    drive.run(seconds, random_twists(7))
    drive.to_board.corrupt = drive.to_pc.corrupt = 0.0
    drive.run(2.0, [(0.0, 0.0, 0.0)])
    lost = sum(drive.dialect.spoken.dropped.values())
    assert drive.wrong_packets == drive.wrong_commands == 0
    assert lost > 10 * seconds
    assert drive.obeyed > 15 * seconds
    assert tuple(drive.published) == tuple(drive.body.true)
    assert len(drive.counts) == len(drive.true)
    pose, truth = drive.odometry.pose, drive.truth.pose
    off = np.hypot(pose.x - truth.x, pose.y - truth.y)
    path = np.abs(np.diff(drive.true, axis=0)).sum(axis=0).max() * drive.wheels.metres_per_edge[0]
    print(f"{lost} of {len(drive.true)} packets dropped, {drive.dialect.spoken.repaired} periods repaired, "
          f"{drive.obeyed} commands obeyed; yaw off by {abs(pose.yaw - truth.yaw):.1e} rad, position by {off:.1e} m "
          f"after a path of {path:.0f} m")
    assert abs(pose.yaw - truth.yaw) < 1e-6
    assert off < 1e-4 * path
