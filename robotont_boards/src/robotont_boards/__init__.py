"""Robotont's boards with the official firmware, made from its grammar byte for byte, traps included.

Each runs on a virtual clock: `receive(data, now)` is one write of the PC, `advance(now)` lets time pass and returns
the bytes that the board has sent meanwhile. The motors are an object with `turn(efforts, seconds)` -> counted
edges. Nothing here uses the driver's code. The fate of commands is recorded: `executed`, `swallowed`, `inversions`.
"""

from robotont_boards.robotont2 import Robotont2Board
from robotont_boards.robotont3 import Robotont3Board
from robotont_boards.virtual_board import POSITIONS

__all__ = ["BOARDS", "POSITIONS", "Robotont2Board"]

BOARDS = {"robotont2": Robotont2Board, "robotont3": Robotont3Board}
