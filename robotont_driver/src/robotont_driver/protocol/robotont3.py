"""Robotont of generation 3 with the official firmware: the lines of generation 2 over USB, and traps of its own."""

from robotont_driver.protocol.robotont2 import Robotont2

USB_ID = "0483:5740"  # STM32 virtual serial port
TRANSFER = 64         # [bytes] of a USB transfer; a line is shorter
STILL = b"LM:8:0:0:0\n"  # a mode of the lights that the firmware does not have: nothing animates them


class Robotont3(Robotont2):
    """As generation 2, but every USB transfer is taken for a whole line, and a field too few halts the board.

    `encode` gives lines of less than 64 bytes, each for one write, so a line is a transfer. ESC is unknown there. Its
    output comes in bursts of 1024 bytes, about 17 lines.
    """

    name = "robotont3"
    hello = b""
    goodbye = b""
    pause = 0.0
    fastest = 0.40

    def encode_lights(self, first, colours):
        """The lines that show these colours and turn all other lights off; none when they do not fit into a transfer.

        Firmware without lights ignores them. The last colour is shown up to the last light, so equal ones at the end
        fit. The board's buffer keeps what a former line left behind a shorter one, hence the padding.
        """
        different = len(colours)
        while different > 1 and colours[different - 2] == colours[-1]:
            different -= 1
        values = ":".join(str(red << 16 | green << 8 | blue) for red, green, blue in colours[:different])
        line = f"LS:{first}:{first + len(colours) - 1}:{values}"
        return [STILL, line.ljust(TRANSFER - 2).encode() + b"\n"] if colours and len(line) <= TRANSFER - 2 else []
