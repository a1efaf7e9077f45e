"""Robotont of generation 3 with the official firmware: the lines of generation 2 over USB, and traps of its own."""

from robotont_driver.dialects.robotont2 import Robotont2

USB_ID = "0483:5740"  # STM32 virtual serial port


class Robotont3(Robotont2):
    """As generation 2, but every USB transfer is taken for a whole line, and a field too few halts the board.

    `encode` gives lines of less than 64 bytes, each for one write, so a line is a transfer. ESC is unknown there. Its
    output comes in bursts of 1024 bytes, about 17 lines. Lights exist on branches whose lines differ, so none is sent.
    """

    name = "robotont3"
    hello = b""
    goodbye = b""
    pause = 0.0
    fastest = 0.40
    burst = 18

    def encode_lights(self, first, colours):
        """None: a line that the firmware interprets differently can halt it."""
        return []
