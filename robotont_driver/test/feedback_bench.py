"""A board that sends feedback packets, and their reader, without a port between them."""

import random

from robotont_driver.protocol.feedback_reader import FeedbackReader
from robotont_testing.stand_in_board import Board

REACH = 300  # [edges per period]


class Reader(FeedbackReader):
    """A reader of packets at 50 Hz, by the clock of the `Sender`s."""

    def feed(self, data):
        """As the packet that was made last arrives."""
        return super().feed(data, Sender.now)


def reader(mode="auto", wheels=3):
    """A fresh reader of that mode."""
    return Reader(wheels, REACH, 50.0, mode)


def total(packets):
    """Of each wheel."""
    return [sum(column) for column in zip(*packets)]


class Sender:
    """Feedback packets of a board that drives at random, 20 ms each. `now`: [s] the time, of all boards."""

    now = 0.0

    def __init__(self, wheels=3, start=0, seed=1):
        self.board = Board("unused", wheels, start_totals=start)
        self.random = random.Random(seed)
        self.sent = []

    def packet(self, counts=None):
        Sender.now += 0.02
        board = self.board
        counts = counts or [self.random.randint(-200, 200) for _ in range(board.wheels)]
        board.motors.follow(counts)
        self.sent.append(tuple(counts))
        data = board.packet(counts)
        board.counter = (board.counter + 1) % 256
        return data
