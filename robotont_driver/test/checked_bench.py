"""A board that sends feedback packets, and their reader, without a port between them."""

import random

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.checked import Checked
from robotont_testing.robots import SHIPPED
from robotont_testing.stand_in_board import PERIOD, Board

REACH = 300  # [edges per period]


class Reader(Checked):
    """The protocol, of a robot with three wheels, by the clock of the `Sender`s."""

    def __init__(self):
        super().__init__(read_wheels(SHIPPED))

    def feed(self, data):
        """As the packet that was made last arrives."""
        return super().feed(data, Sender.now)


class Sender:
    """Feedback packets of a `Board` that drives at random, one a period. `now`: [s] the time, of all boards."""

    now = 0.0

    def __init__(self, start=0, seed=1, **board):
        self.board = Board("unused", start_totals=start, **board)
        self.random = random.Random(seed)
        self.sent = []

    def packet(self, counts=None):
        Sender.now += PERIOD
        board = self.board
        counts = counts or [self.random.randint(-200, 200) for _ in range(board.wheels)]
        board.motors.follow(counts)
        self.sent.append(tuple(counts))
        data = board.packet(counts)
        board.counter = (board.counter + 1) % 256
        return data
