"""The firmware's loop: counts in, commands in, efforts out, packet out, once per period.

It reaches the hardware only through a board object:

    wait_tick()          wait for the next period; return how many began since the last call, 0 to end
    counts(totals)       fill totals[wheel] with the encoder counters latched at that tick, 0..65535
    drive(wheel, effort) effort -FULL_EFFORT..FULL_EFFORT; 0 lets the wheel roll
    fault(wheel)         True while the motor driver reports a fault
    battery()            [mV] of the motors' battery; a board that cannot measure it has no such method
    read(buffer)         read at most len(buffer) waiting bytes; return how many; never wait
    write(buffer, size)  send buffer[0:size]
    feed()               feed the watchdog
    stop()               switch all motors off for good

so the same loop drives the robot, the simulator and the tests. Nothing in it allocates memory after
`start`, so that it can run with MicroPython's heap locked.
"""

from array import array

from robotont_firmware import __version__, protocol
from robotont_firmware import gain_bounds as bounds
from robotont_firmware.compat import const, micropython, ptr32
from robotont_firmware.fault_watch import DRIVER_FAULT, NO_FAULT, OVERLOAD
from robotont_firmware.protocol import Receiver, Sender
from robotont_firmware.wheel_speed import Pid

_FLAGS, _MISSED, _REFUSED, _WHEELS = const(0), const(1), const(2), const(3)  # places in the status
_LAG = const(1280)  # [1/256 unit] a wheel that is farther from its aim changes the robot's motion,
_CHANGE = const(128)  # [1/256 unit] as does a set-point that has to go farther than this in a period (0.23 m/s^2),
_SETTLING = const(10)  # [periods] and for so long afterwards one wheel may drag another
_ZERO = const(0x8000000)  # added to numbers that machine code reads without sign
SIMULATED = ("simulated", "test")  # causes of a start that was no reset of a board


class Controller:
    """Runs `wheels` wheels (default config.WHEELS) of `board` with the numbers in `config`.

    reset_cause: a word for the banner. After any but SIMULATED the motors stay off until a command of all zeros
    came: a PC that still commands gets no motion. Raises ValueError when a number of `config` is out of range.
    """

    def __init__(self, board, config, wheels=None, reset_cause="unknown"):
        wheels = wheels or config.WHEELS
        bounds.check(config)
        self._board = board
        self._config = config
        self._wheels = wheels
        self._receiver = Receiver(wheels)
        self._sender = Sender(wheels)
        self._pids = [Pid(config) for _ in range(wheels)]
        self._rx = bytearray(bounds.line_bytes(config))
        self._totals = array("H", [0] * wheels)
        self._last_totals = array("H", [0] * wheels)
        self._counts = array("i", [0] * wheels)
        self._targets = array("i", [0] * wheels)  # the command within the motors' reach [1/256 unit]
        self._setpoints = array("i", [0] * wheels)  # follows the targets at MAX_ACCELERATION, or MAX_BRAKING
        self._max_speed = config.MAX_SPEED * 256
        self._references = array("i", [0] * wheels)  # of the wheels' controllers [1/256 unit]
        self._straight = array("i", [0] * wheels)  # see _accelerate
        self._turning = 0
        self._follow = config.FOLLOW
        self._arc = config.ARC
        self._max_change = config.MAX_ACCELERATION * 256
        self._max_braking = config.MAX_BRAKING * 256
        self._change = self._max_change  # of them, by the newest command
        self._unsettled = array("i", [0] * wheels)  # [periods] until the robot around the wheel moves as it should
        self._counter = 0
        self._silence = config.TIMEOUT  # [periods] since the last valid packet
        self._braking = 0  # [periods] left of the braking after a time-out
        self._fault_hold = 0  # [periods] that a fault stands at least; 0: no fault
        self._waits_for_zero = reset_cause not in SIMULATED
        self._read_battery = getattr(board, "battery", None)
        self._battery_low = 0  # [periods] that the battery has been low
        self._answer_wait = 0  # [periods] until the next answer
        self._status = array("B", [0] * (_WHEELS + wheels))
        about = (
            f"robotont_firmware {__version__} wheels {wheels} rate {config.RATE} units edges/period "
            f"profile {config.PROFILE} reset {reset_cause}"
        )
        self._banner = protocol.seal(about)
        self._answer = protocol.seal("identity " + about)

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
        """Do the work of one period, `periods` ticks after the last one."""
        self._measure()
        self._receive(periods)
        if self._has_fault(periods) or self._waits_for_zero:
            self._brake(periods)
        elif self._silence < self._config.TIMEOUT:
            self._drive(periods)
        else:
            self._brake(periods)
        # A tick that was missed shows as a gap in the counter; the totals give the PC the missing counts.
        self._counter = (self._counter + periods) & 0xFF
        self._describe(periods)
        size = self._sender.pack(self._counter - 1, self._counts, self._totals, self._status)
        self._board.write(self._sender.buffer, size)
        self._introduce(periods)

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

    @micropython.native
    def _take_command(self):
        """Make the command the target; faster than MAX_SPEED, all wheels shrink by one factor."""
        wished = self._receiver.setpoints
        fastest = 0
        for wheel in range(self._wheels):
            fastest = max(fastest, abs(wished[wheel]))
        self._change = self._max_change
        if fastest == 0:
            self._waits_for_zero = False
            self._change = self._max_braking
        for wheel in range(self._wheels):
            target = wished[wheel]
            if fastest > self._max_speed:
                # Both factors lose 4 bits, so that the product stays below 2^30.
                target = target * (self._max_speed >> 4) // (fastest >> 4)
            self._targets[wheel] = target

    @micropython.native
    def _drive(self, periods):
        """Bring the set-points nearer to the targets and let every wheel's controller act."""
        fastest = self._slew(self._change)
        self._accelerate()
        for wheel in range(self._wheels):
            pid = self._pids[wheel]
            setpoint = self._setpoints[wheel]
            settled = self._unsettled[wheel] <= 0
            self._unsettled[wheel] -= 0 if settled else periods
            straight = self._straight[wheel]
            effort = pid.step(setpoint, self._counts[wheel], periods, settled, fastest, straight, self._turning)
            self._board.drive(wheel, effort)
            if pid.lag > _LAG + (abs(setpoint) >> 3):
                self._unsettle(wheel)
            if pid.fault != NO_FAULT:
                self._latch(wheel, pid.fault)
        if self._fault_hold > 0:
            self._brake(0)

    @micropython.viper
    def _accelerate(self):
        """Note by what share the robot turns faster, and by what else each wheel accelerates: an arc bends the way.

        All in 1/256 unit per period, in the direction of each wheel, for wheels at even angles: what they turn alike
        is the robot's turn, and the bend is across the motion, in which the neighbours of a wheel differ.
        """
        wheels = int(self._wheels)
        references = ptr32(self._references)
        pids, setpoints, straight = self._pids, self._setpoints, self._straight
        wished = turn = 0
        for wheel in range(wheels):
            reference = int(pids[wheel].reference)
            references[wheel] = reference + _ZERO
            turn += reference
            wished += int(setpoints[wheel])
        turning = (wished - turn) // wheels * int(self._follow) >> 8
        self._turning = turning
        turn = turn // wheels >> 4
        arc = int(self._arc)
        for wheel in range(wheels):
            before = references[wheel - 1 if wheel > 0 else wheels - 1]
            across = before - references[wheel + 1 if wheel < wheels - 1 else 0]
            straight[wheel] = (across >> 4) * turn // arc - turning

    @micropython.native
    def _brake(self, periods):
        """Stop the wheels without a fault as fast as the motors may, then let all roll."""
        self._clear(self._setpoints)
        for wheel in range(self._wheels):
            pid = self._pids[wheel]
            if self._braking <= 0 or self._fault_of(wheel) != NO_FAULT:
                pid.reset(periods)
                self._board.drive(wheel, 0)
            else:
                self._board.drive(wheel, pid.brake(self._counts[wheel], periods))
        self._braking = max(0, self._braking - periods)

    @micropython.native
    def _fault_of(self, wheel):
        """Return the fault that stands for a wheel; an overload is none."""
        fault = self._status[_WHEELS + wheel]
        return NO_FAULT if fault == OVERLOAD else fault

    @micropython.viper
    def _slew(self, limit: int) -> int:
        """Move the set-points by at most `limit`, all by the same fraction of their way; return the fastest.

        Both in 1/256 unit.
        """
        targets, setpoints = self._targets, self._setpoints
        wheels = int(self._wheels)
        farthest = fastest = 0
        for wheel in range(wheels):
            change = int(targets[wheel]) - int(setpoints[wheel])
            change = change if change > 0 else 0 - change
            farthest = change if change > farthest else farthest
        for wheel in range(wheels):
            setpoint = int(setpoints[wheel])
            if farthest > 0:
                change = int(targets[wheel]) - setpoint
                setpoint += change * limit // farthest if farthest > limit else change
                setpoints[wheel] = setpoint
            setpoint = setpoint if setpoint > 0 else 0 - setpoint
            fastest = setpoint if setpoint > fastest else fastest
        if farthest > _CHANGE:
            self._unsettle(-1)
        return fastest

    @micropython.native
    def _unsettle(self, but):
        """The robot changes its motion: one wheel may drag another now. `but`: the one that does not follow."""
        for wheel in range(self._wheels):
            if wheel != but:
                self._unsettled[wheel] = _SETTLING

    @micropython.native
    def _has_fault(self, periods):
        """Return True from a fault until FAULT_HOLD is over, all pins quiet for it, and the command all zeros.

        One faulty motor stops all: the rest alone would drive the robot somewhere else.
        """
        quiet = True
        for wheel in range(self._wheels):
            if self._board.fault(wheel):
                self._latch(wheel, DRIVER_FAULT)
                quiet = False
        if quiet and self._fault_hold > 0:
            if self._fault_hold > periods:
                self._fault_hold -= periods
                self._waits_for_zero = True  # a zero that came before the fault was over does not count
            else:
                self._fault_hold = 1
                if not self._waits_for_zero:
                    self._fault_hold = 0
                    for wheel in range(self._wheels):
                        self._status[_WHEELS + wheel] = NO_FAULT
        return self._fault_hold > 0

    @micropython.native
    def _latch(self, wheel, fault):
        """Note a wheel's fault: the others brake, and the motors stay off until a command of all zeros."""
        if self._fault_hold == 0:
            self._braking = self._config.BRAKING
        self._status[_WHEELS + wheel] = fault
        self._fault_hold = self._config.FAULT_HOLD
        self._waits_for_zero = True

    @micropython.native
    def _describe(self, periods):
        """Bring the status field up to date."""
        status = self._status
        flags = 0
        if self._silence >= self._config.TIMEOUT:
            flags |= protocol.TIMED_OUT
        if self._waits_for_zero:
            flags |= protocol.WAITS_FOR_ZERO
        if self._read_battery is not None and self._is_battery_low(periods):
            flags |= protocol.BATTERY_IS_LOW
        status[_FLAGS] = flags
        status[_MISSED] = (status[_MISSED] + periods - 1) & 0xFF
        status[_REFUSED] = self._receiver.dropped & 0xFF
        if self._fault_hold == 0:
            for wheel in range(self._wheels):
                status[_WHEELS + wheel] = OVERLOAD if self._pids[wheel].overloaded else NO_FAULT

    def _is_battery_low(self, periods):
        """Return True when the battery has been below BATTERY_LOW for a second."""
        if self._read_battery() >= self._config.BATTERY_LOW:
            self._battery_low = 0
        elif self._battery_low < self._config.RATE:
            self._battery_low += periods
        return self._battery_low >= self._config.RATE

    @micropython.native
    def _introduce(self, periods):
        """Answer the PC's request for the identity."""
        if self._answer_wait > periods:
            self._answer_wait -= periods
        elif self._receiver.asked:
            self._receiver.asked = False
            self._answer_wait = self._config.ANSWER_INTERVAL
            self._board.write(self._answer, len(self._answer))

    @micropython.native
    def _clear(self, numbers):
        for wheel in range(self._wheels):
            numbers[wheel] = 0
