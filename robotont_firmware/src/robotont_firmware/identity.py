"""Who the board is: its banner at the start, and the same to a PC that asks."""

from robotont_firmware import __version__, protocol, robot_numbers
from robotont_firmware.compat import micropython


class Identity:
    """Writes to `board`; reset_cause: a word for the banner."""

    def __init__(self, board, config, wheels, reset_cause):
        about = (
            f"robotont_firmware {__version__} wheels {wheels} rate {config.RATE} units edges/period "
            f"profile {config.PROFILE} reset {reset_cause}"
        )
        self.banner = protocol.seal(about)
        self._board = board
        self._answer = protocol.seal("identity " + about)
        self._interval = robot_numbers.ticks(config, config.ANSWER_INTERVAL)
        self._wait = 0  # [periods] until the next answer

    def introduce(self):
        """Send the banner."""
        self._board.write(self.banner, len(self.banner))

    @micropython.native
    def answer(self, receiver, periods):
        """Answer the request that `receiver` may have heard."""
        if self._wait > periods:
            self._wait -= periods
        elif receiver.asked:
            receiver.asked = False
            self._wait = self._interval
            self._board.write(self._answer, len(self._answer))
