"""The firmware's loop: counts in, commands in, efforts out, packet out, once per period.

It knows the hardware only through a board object:

    wait_tick()          wait for the next period; return how many began since the last call, 0 to end
    counts(totals)       fill totals[wheel] with the encoder counters latched at that tick, 0..65535
    drive(wheel, effort) effort -FULL_EFFORT..FULL_EFFORT; 0 lets the wheel roll
    fault(wheel)         True while the motor driver reports a fault
    read(buffer)         read at most len(buffer) waiting bytes; return how many; never wait
    write(buffer, size)  send buffer[0:size]
    feed()               feed the watchdog
    stop()               switch all motors off for good

so the same loop drives the robot, the simulator and the tests. Nothing in it allocates memory after
`start`, so that it can run with MicroPython's heap locked.
"""

from array import array

from robotont_firmware import __version__
from robotont_firmware.compat import micropython
from robotont_firmware.pid import Pid
from robotont_firmware.protocol import Receiver, Sender

_RX_SIZE = 256  # [bytes] more than 115200 baud bring in one period


class Controller:
    """Runs `wheels` wheels (default config.WHEELS) of `board` with the numbers in `config`.

    reset_cause: a word for the banner. Raises ValueError when a gain of `config` is out of range.
    """

    def __init__(self, board, config, wheels=None, reset_cause="unknown"):
        wheels = wheels or config.WHEELS
        self._board = board
        self._config = config
        self._wheels = wheels
        self._receiver = Receiver(wheels)
        self._sender = Sender(wheels)
        self._pids = [Pid(config) for _ in range(wheels)]
        self._rx = bytearray(_RX_SIZE)
        self._totals = array("H", [0] * wheels)
        self._last_totals = array("H", [0] * wheels)
        self._counts = array("i", [0] * wheels)
        self._targets = array("i", [0] * wheels)  # the command within the motors' reach [1/256 unit]
        self._setpoints = array("i", [0] * wheels)  # follows the targets at MAX_ACCELERATION
        self._max_speed = config.MAX_SPEED * 256
        self._max_change = config.MAX_ACCELERATION * 256
        self._counter = 0
        self._silence = config.TIMEOUT  # [periods] since the last valid packet
        self._braking = 0  # [periods] left of the braking after a time-out
        self._fault_hold = 0  # [periods] until the fault pins have been quiet long enough; 0: no fault
        self._notice_wait = 0
        self._noticed = 0  # the receiver's count of dropped lines that the PC knows
        banner = f"# robotont_firmware {__version__} wheels {wheels} reset {reset_cause}\n"
        self._banner = banner.encode()
        self._fault_lines = [f"# fault motor {wheel}\n".encode() for wheel in range(wheels)]

    def start(self):
        """Send the banner and take the encoders as they stand for the start of the count."""
        self._board.write(self._banner, len(self._banner))
        self._board.counts(self._last_totals)

    def run(self):
        """Run until the board ends it (return False) or the PC asks for the REPL (return True).

        However it ends, also by an exception, the motors are off then.
        """
        board = self._board
        try:
            while not self._receiver.leave:
                periods = board.wait_tick()
                if periods == 0:
                    return False
                self.step(periods)
                board.feed()
            return True
        finally:
            board.stop()

    @micropython.native
    def step(self, periods):
        """Do the work of one tick, `periods` (normally 1) after the one before."""
        self._measure()
        self._receive(periods)
        if self._has_fault(periods):
            self._release_motors()
        elif self._silence < self._config.TIMEOUT:
            self._drive()
        else:
            self._brake(periods)
        # A tick that was missed shows as a gap in the counter; the totals tell the PC what it held.
        self._counter = (self._counter + periods) & 0xFF
        self._board.write(
            self._sender.buffer, self._sender.pack(self._counter - 1, self._counts, self._totals)
        )
        self._notice_dropped(periods)

    @micropython.native
    def _measure(self):
        """Take each encoder's edges since the last tick, as a difference modulo 2^16."""
        self._board.counts(self._totals)
        for wheel in range(self._wheels):
            change = (self._totals[wheel] - self._last_totals[wheel]) & 0xFFFF
            self._counts[wheel] = change - 0x10000 if change & 0x8000 else change
            self._last_totals[wheel] = self._totals[wheel]

    @micropython.native
    def _receive(self, periods):
        """Take the newest valid command, or stop when none came for TIMEOUT."""
        receiver = self._receiver
        if receiver.feed(self._rx, self._board.read(self._rx)) > 0:
            self._silence = 0
            self._take_command()
        elif self._silence < self._config.TIMEOUT:
            self._silence += periods
            if self._silence >= self._config.TIMEOUT:
                receiver.release()
                self._clear(self._targets)
                self._braking = self._config.BRAKING
                self._say(b"# timeout: no valid packet, motors stop\n")

    @micropython.native
    def _take_command(self):
        """Make the command the target; faster than MAX_SPEED, all wheels shrink by one factor."""
        wished = self._receiver.setpoints
        fastest = 0
        for wheel in range(self._wheels):
            fastest = max(fastest, abs(wished[wheel]))
        for wheel in range(self._wheels):
            target = wished[wheel]
            if fastest > self._max_speed:
                # Both factors lose 4 bits, so that the product stays below 2^30.
                target = target * (self._max_speed >> 4) // (fastest >> 4)
            self._targets[wheel] = target

    @micropython.native
    def _drive(self):
        """Bring the set-points nearer to the targets and let every wheel's controller act."""
        self._slew(self._max_change)
        for wheel in range(self._wheels):
            self._board.drive(wheel, self._pids[wheel].step(self._setpoints[wheel], self._counts[wheel]))

    @micropython.native
    def _brake(self, periods):
        """Stop the wheels as fast as the motors can, then let them roll: nobody is in command."""
        if self._braking <= 0:
            self._release_motors()
            return
        self._braking -= periods
        self._clear(self._setpoints)
        for wheel in range(self._wheels):
            self._board.drive(wheel, self._pids[wheel].brake(self._counts[wheel]))

    @micropython.native
    def _slew(self, limit):
        """Move the set-points by at most `limit` [1/256 unit], all by the same fraction of their way."""
        targets = self._targets
        setpoints = self._setpoints
        farthest = 0
        for wheel in range(self._wheels):
            farthest = max(farthest, abs(targets[wheel] - setpoints[wheel]))
        for wheel in range(self._wheels):
            change = targets[wheel] - setpoints[wheel]
            if farthest > limit:
                change = change * limit // farthest
            setpoints[wheel] += change

    @micropython.native
    def _has_fault(self, periods):
        """Return True from a fault until all pins were quiet for FAULT_HOLD and the command is all zeros.

        One faulty motor stops all: the rest alone would drive the robot somewhere else.
        """
        for wheel in range(self._wheels):
            if self._board.fault(wheel):
                if self._fault_hold == 0:
                    self._say(self._fault_lines[wheel])
                self._fault_hold = self._config.FAULT_HOLD
                return True
        if self._fault_hold > periods:
            self._fault_hold -= periods
        elif self._fault_hold > 0:
            self._fault_hold = 1
            for wheel in range(self._wheels):
                if self._targets[wheel] != 0:
                    return True
            self._fault_hold = 0
            self._say(b"# fault cleared\n")
        return self._fault_hold > 0

    def _release_motors(self):
        """Let all wheels roll and start afresh from standstill afterwards."""
        self._clear(self._setpoints)
        for wheel in range(self._wheels):
            self._board.drive(wheel, 0)
            self._pids[wheel].reset()

    @micropython.native
    def _notice_dropped(self, periods):
        """Tell the PC, at most once in NOTICE_INTERVAL, how many of its lines were refused."""
        if self._notice_wait > periods:
            self._notice_wait -= periods
        elif self._receiver.dropped != self._noticed:
            self._noticed = self._receiver.dropped
            self._notice_wait = self._config.NOTICE_INTERVAL
            self._board.write(self._sender.buffer, self._sender.notice(b"# dropped ", self._noticed))

    def _say(self, line):
        self._board.write(line, len(line))

    def _clear(self, numbers):
        for wheel in range(self._wheels):
            numbers[wheel] = 0
