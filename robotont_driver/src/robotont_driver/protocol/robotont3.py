"""Robotont of generation 3 with the official firmware: the lines of generation 2 over USB, and traps of its own."""

import math

from robotont_driver.protocol.board_wheels import PERIOD
from robotont_driver.protocol.robotont2 import Robotont2

USB_ID = "0483:5740"  # STM32 virtual serial port
TRANSFER = 64         # [bytes] of a USB transfer; a line is shorter
TICK = 0.001 / PERIOD  # [periods] of the clock by which the board measures speeds
DRAWING = 1.25        # [periods] of a loop that draws the display, every tenth; ...
MEAN = 1.025          # ... of all loops
LONGEST = 2.0         # [periods] a multiple of any period has whole edges, too
WHOLE = 0.003         # [edges] by which a number of edges is not whole, out of a line's six decimals
STILL = b"LM:8:0:0:0\n"  # a mode of the lights that the firmware does not have: nothing animates them


class Robotont3(Robotont2):
    """As generation 2, but every USB transfer is taken for a whole line, and a field too few halts the board.

    `encode` gives lines of less than 64 bytes, each for one write, so a line is a transfer. ESC is unknown there.

    The board measures speeds over the true time since its last loop, in whole milliseconds, but moves its pose by them
    times 0.02 s, also where its display has taken 25 ms: the pose is late.
    """

    name = "robotont3"
    hello = b""
    goodbye = b""
    pause = 0.0
    fastest = 0.40

    def period_length(self, edges, elapsed):
        """By what a period of the board was longer than it says.

        It is the time nearest to `elapsed`, where the link was not late, in which the wheels have made whole edges.
        Over lost lines it is a mean, with one drawing or none.
        """
        if edges is None:
            periods = max(1, round(elapsed / MEAN))
            return 1 + (DRAWING - 1) / periods if elapsed - periods > (DRAWING - 1) / 2 else 1.0
        if elapsed >= LONGEST:
            elapsed = 1.0
        own = [edge * self._board_wheels.edges_of_board * TICK for edge in edges]
        ticks = sorted(range(round(1 / TICK), round(LONGEST / TICK)), key=lambda tick: abs(tick * TICK - elapsed))
        whole = (tick * TICK for tick in ticks if all(abs(math.remainder(edge * tick, 1)) < WHOLE for edge in own))
        return next(whole, min(max(elapsed, 1.0), DRAWING))

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
