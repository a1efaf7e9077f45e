"""The firmware's loop: counts in, commands in, efforts out, packet out, once per period.

It reaches the hardware only through a board object:

    wait_tick()          wait for the next period; return how many began since the last call
    counts(totals)       fill totals[wheel] with the encoder counters latched at that tick, 0..65535
    drive(wheel, effort) effort -FULL_EFFORT..FULL_EFFORT (robot_numbers); 0 lets the wheel roll
    fault(wheel)         True while the motor driver reports a fault
    battery()            [mV] of the motors' battery
    load()               [%] of a period, the most since the last call, that the work took
    light(on)            switch a light; boards that lack these three have no such methods
    read(buffer)         read at most len(buffer) waiting bytes; return how many; never wait
    write(buffer, size)  send buffer[0:size]
    feed()               feed the watchdog

so the same loop drives the robot, the simulator and the tests. Nothing in it allocates memory after
`start`, so that it can run with MicroPython's heap locked.
"""

from array import array

from robotont_firmware import __version__, robot_numbers
from robotont_firmware.compat import micropython
from robotont_firmware.fault_watch import DRIVER_FAULT, NO_FAULT, OVERLOAD, TOO_MANY
from robotont_firmware.protocol import ASK, LEAVE, TEST, Receiver, Sender, line_of
from robotont_firmware.setpoints import Setpoints, measure
from robotont_firmware.status import BEAT, TIMED_OUT, WAITS_FOR_ZERO, WHEELS, Status
from robotont_firmware.wheel_speed import HEAT, Pid

SIMULATED = ("simulated", "test")  # causes of a start that was no reset of a board


class Controller:
    """Runs the wheels of `board` with the numbers in `config`.

    reset_cause: a word for the banner. After any but SIMULATED the motors stay off until a command of all zeros
    came: a PC that still commands gets no motion. Raises ValueError when a number of `config` is out of range.
    """

    def __init__(self, board, config, reset_cause="unknown"):
        wheels, numbers = config.WHEELS, robot_numbers.Numbers(config)
        self._board = board
        self._test_effort = config.TEST_EFFORT
        self._numbers, self._brake, self._max_heat = numbers, numbers.brake, numbers.max_heat
        self._timeout, self._brake_time, self._hold_time, self._test_time = robot_numbers.in_periods(
            config, config.TIMEOUT, config.BRAKING, config.FAULT_HOLD, config.TEST_TIME)
        self._test_edges = max(1, robot_numbers.free_speed(config, 0) * config.TEST_SPEED // 1000)  # per period
        self._wheels = wheels
        self._receiver = Receiver(wheels)
        self._sender = Sender(wheels)
        self._pids = [Pid(config, numbers) for _ in range(wheels)]
        self._rx = bytearray(robot_numbers.line_bytes(config))
        self._totals = array("H", [0] * wheels)
        self._last_totals = array("H", [0] * wheels)
        self._counts = array("i", [0] * wheels)
        self._setpoints = Setpoints(wheels, numbers)
        self._counter = 0
        self._silence = self._timeout  # [periods] since the last valid packet
        self._undriven = self._brake_time  # [periods] since a command was obeyed: so long the wheels are braked
        self._fault_hold = 0  # [periods] that a fault stands at least, then 1 until a zero; 0: no fault
        self._waits_for_zero = reset_cause not in SIMULATED
        self._test_left = 0  # [periods] that one wheel is still driven by an order `!test`
        self._tested = 0  # its order, from 0 on
        self._status = Status(board, config, wheels)
        about = (f"robotont_firmware {__version__} wheels {wheels} rate {config.RATE} units edges/period "
                 f"profile {config.PROFILE} reset {reset_cause}")  # fmt: skip
        self._banner, self._identity = line_of("# " + about), line_of("# identity " + about)

    def start(self):
        """Send the banner and take the encoders as they stand for the start of the count."""
        self._board.write(self._banner, len(self._banner))
        self._board.counts(self._last_totals)

    def run(self):
        """Run until the PC asks for the REPL; the motors are as they were then."""
        board = self._board
        while self._receiver.order != LEAVE:
            self.step(board.wait_tick())
            board.feed()

    @micropython.native
    def step(self, periods):
        """Do the work of one period, `periods` ticks after the last one."""
        board, receiver, wheels = self._board, self._receiver, self._wheels
        board.counts(self._totals)
        measure(self._totals, self._last_totals, self._counts, wheels)
        self._receive(periods)
        ready = not self._has_fault(periods) and not self._waits_for_zero
        commanded = ready and self._silence < self._timeout
        if ready and not commanded and (receiver.order >= TEST or self._test_left > 0):
            self._test(periods)
        elif commanded or self._undriven < self._brake_time:
            self._drive(periods, commanded)
        else:
            self._rest(periods)
        self._undriven = 0 if commanded else min(self._undriven + periods, self._brake_time)
        # A tick that was missed shows as a gap in the counter; the totals give the PC the missing counts.
        self._counter = counter = (self._counter + periods) & 0xFF
        flags = TIMED_OUT if self._silence >= self._timeout and self._test_left <= 0 else 0
        if self._waits_for_zero:
            flags |= WAITS_FOR_ZERO
        status = self._status
        status.update(flags, periods, receiver.dropped)
        if counter & BEAT == 0:
            status.show(counter, flags == 0, self._fault_hold > 0)
            for wheel in range(wheels if self._fault_hold == 0 else 0):
                status.fields[WHEELS + wheel] = NO_FAULT if self._pids[wheel].n[HEAT] < self._max_heat else OVERLOAD
        sender = self._sender
        size = sender.pack(counter - 1, self._counts, self._totals, status.fields)
        board.write(sender.buffer, size)
        if receiver.order >= TEST:
            receiver.order = 0  # obeyed, or for nothing
        elif receiver.order == ASK and counter & BEAT == 0:  # not at each question: that would fill the line
            receiver.order = 0
            board.write(self._identity, len(self._identity))

    def _receive(self, periods):
        """Take the newest valid command, or stop when none came for TIMEOUT."""
        receiver = self._receiver
        if receiver.feed(self._rx, self._board.read(self._rx)) > 0:
            self._silence = self._test_left = 0
            if self._setpoints.take(receiver.setpoints) == 0:
                self._waits_for_zero = False
        else:
            self._silence = min(self._silence + periods, self._timeout)
            if self._silence == self._timeout:
                receiver.checked = False  # another, plain PC may take over

    @micropython.native
    def _drive(self, periods, commanded):
        """Bring the set-points nearer to the targets and let each controller act; by some faults a wheel is shorted."""
        setpoints, wheels = self._setpoints, self._wheels
        stands = not commanded or setpoints.advance() == 0
        pids = self._pids
        counts = self._counts
        brake = self._brake if commanded else self._softer(periods)
        setpoints.accelerate(pids)
        board, broken, faults = self._board, self._fault_hold > 0, self._status.fields
        now, bends = setpoints.now, setpoints.bends
        for wheel in range(wheels):
            pid = pids[wheel]
            if stands:
                now[wheel] = 0
            if broken and (NO_FAULT < faults[WHEELS + wheel] < OVERLOAD or faults[WHEELS + wheel] > TOO_MANY):
                effort = int(faults[WHEELS + wheel] != DRIVER_FAULT)  # its counts tell nothing, but a short brakes it
                pid.reset(periods)
            elif stands:
                effort = pid.stop(counts[wheel], periods, commanded, brake)
            else:
                effort = pid.step(now[wheel], counts[wheel], periods, bends[wheel])
            board.drive(wheel, effort)
            if commanded and pid.fault != NO_FAULT:
                self._latch(wheel, pid.fault)

    def _softer(self, periods):
        """Return the gain with which the fastest wheel gets MAX_TORQUE, or less: braked alike, they stop straight."""
        numbers, fastest = self._numbers, 0
        most = (numbers.reach * periods + periods - 1) >> numbers.shift  # [edges] more are no speed
        for wheel in range(self._wheels):
            edges = abs(self._counts[wheel])
            if fastest < edges <= most:
                fastest = edges
        speed = max(1, (fastest << numbers.shift) // periods)
        return max(0, min(self._brake, (numbers.max_torque << 16) // speed - numbers.forward))

    def _rest(self, periods):
        """Let all wheels roll."""
        for wheel in range(self._wheels):
            self._setpoints.now[wheel] = 0
            self._pids[wheel].reset(periods)
            self._board.drive(wheel, 0)

    def _test(self, periods):
        """Drive one wheel for TEST_TIME, never too fast, and let the others roll; while no commands come."""
        if self._receiver.order >= TEST:
            self._tested, self._test_left = self._receiver.order - TEST, self._test_time
            self._undriven = self._brake_time
        tested = self._tested >> 1
        if abs(self._counts[tested]) > self._test_edges * periods:
            self._test_left = 0
        effort = 0 if self._test_left <= 0 else -self._test_effort if self._tested & 1 else self._test_effort
        for wheel in range(self._wheels):
            self._board.drive(wheel, effort if wheel == tested else 0)
        self._test_left -= periods

    def _has_fault(self, periods):
        """Return True from a fault until FAULT_HOLD is over, all pins quiet for it, and the command all zeros.

        One faulty motor stops all: the rest alone would drive the robot somewhere else.
        """
        if self._fault_hold > 1:
            self._fault_hold = max(1, self._fault_hold - periods)
            self._waits_for_zero = True  # a zero that came before the fault was over does not count
        elif self._fault_hold > 0 and not self._waits_for_zero:
            self._fault_hold = 0
            for wheel in range(self._wheels):
                self._status.fields[WHEELS + wheel] = NO_FAULT
        for wheel in range(self._wheels):
            if self._board.fault(wheel):
                self._latch(wheel, DRIVER_FAULT)
        return self._fault_hold > 0

    def _latch(self, wheel, fault):
        """Note a wheel's fault: the others brake, and the motors stay off until a command of all zeros."""
        self._test_left = 0
        self._status.fields[WHEELS + wheel] = fault
        self._board.drive(wheel, 0)
        self._fault_hold = self._hold_time
        self._waits_for_zero = True
