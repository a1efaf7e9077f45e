"""Generation 2 and 2.1."""

import math
import re

from robotont_boards.virtual_board import (
    BYTE,
    POSITIONS,
    TIME_OUT,
    Board,
    OfficialOdometry,
    as_float,
    atof,
    clamp,
    single,
)

BANNER = b"**** MAIN ****\r\n"
ZERO, HALF, ONE, TWO = map(single, (0, 0.5, 1, 2))
SPEED_PER_EDGE = single(as_float(TWO / single(64) / single(18.75)) * math.pi / as_float(0.01) * as_float(0.035))


class Robotont2Board(Board):
    """Generation 2 and 2.1 on its ST-LINK port. base_frame: firmware 2.1.3 or newer; distance: 0.127 before March 2020.

    Every 10 ms the motors' control, every 20 ms the main loop, every 100 ms a look at the time-out.
    """

    SPEED_LIMIT = 0.3    # [m/s] of each wheel alone
    EFFORT_LIMIT = 0.25
    GAIN, INTEGRAL, CONTROL_PERIOD = single(0.8), single(20) * single(0.01), 0.01
    BUFFER = 254

    def __init__(self, motors, start=0.0, base_frame=True, distance=0.145):
        super().__init__(motors, start)
        self.odometry = OfficialOdometry(distance, math.sin, math.cos)
        self.setpoints = [0.0] * 3
        self.speeds = [0.0] * 3     # [m/s] measured in the newest 10 ms
        self.extra_lines = []       # sent with the next loop: RANGE, POWER of some branches
        self._base_frame = base_frame
        self._distance = distance
        self._stopped = [True] * 3
        self._efforts = [0.0] * 3
        self._counts = [0] * 3      # since the newest control
        self._turned = start        # [s] until when the motors have turned
        self._sums = [ZERO] * 3  # of the control errors
        self._outputs = [HALF] * 3
        self._buffer = bytearray()
        self._complete = False
        self._commanded_at = start
        self._send(BANNER)
        self._every(self.CONTROL_PERIOD, self._control, self.CONTROL_PERIOD)
        self._every(0.1, self._look_at_time, len(BANNER) * BYTE + 0.1)
        self._every(0.02, self._loop, len(BANNER) * BYTE)

    def _send(self, data):
        self._outgoing.append(data)

    def _on_bytes(self, byte):
        self._buffer.append(byte)
        if len(self._buffer) > self.BUFFER:
            self._buffer.clear()
        if byte in b"\r\n" and len(self._buffer) > 3:
            self._complete = True
        if byte == 27:
            for wheel in range(3):
                self._stop(wheel)
            self._buffer.clear()

    def _loop(self):
        if self._complete:
            packet = bytes(self._buffer).partition(b"\0")[0]
            self._buffer.clear()
            self._process(packet)
            self._complete = False
        self.odometry.update(self.speeds)
        for line in self.extra_lines:
            self._send(line)
        self.extra_lines = []
        self._send(self.odometry.line(self._base_frame))

    def _process(self, packet):
        lines = [line for line in re.split(rb"[\r\n]+", packet) if line]
        fields = []
        for field in packet.split(b":")[:6]:
            if not field:
                break
            fields.append(field)
        if not fields or fields[0] not in (b"MS", b"RS"):
            self.swallowed += [(self.now, line) for line in lines if line[:3] in (b"MS:", b"RS:")]
            return
        if len(fields) < 4:
            self.dead = f"undefined behaviour: fields missing in {packet!r}"
            return
        self.executed.append((self.now, lines[0]))
        if len(lines) > 1:  # all but the first
            self.inversions += 1
            self.swallowed += [(self.now, line) for line in lines[1:]]
        numbers = [as_float(atof(field)) for field in fields[1:4]]
        if fields[0] == b"MS":
            for wheel, speed in enumerate(numbers):
                self._set_speed(wheel, speed)
        else:
            vx, vy, turn = numbers
            for wheel, phi in enumerate(map(as_float, POSITIONS)):
                speed = math.hypot(vx, vy) * math.sin(math.atan2(vy, vx) - phi) + self._distance * turn
                if abs(speed) < 1e-5:
                    self._stop(wheel)
                else:
                    self._set_speed(wheel, speed)
        self._commanded_at = self.now

    def _set_speed(self, wheel, speed):
        if self._stopped[wheel]:
            self._sums[wheel], self._outputs[wheel] = ZERO, HALF
            self._stopped[wheel] = False
        self.setpoints[wheel] = clamp(speed, self.SPEED_LIMIT)

    def _stop(self, wheel):
        self._turn()
        self._set_speed(wheel, 0.0)
        self._stopped[wheel] = True
        self._efforts[wheel] = 0.0

    def _look_at_time(self):
        if self.now - self._commanded_at > TIME_OUT + 0.001 - 1e-6:  # it compares whole milliseconds
            for wheel in range(3):
                self._stop(wheel)

    def _turn(self):
        """Let the motors turn until now, in whole milliseconds."""
        until = math.ceil(1000 * self.now - 1e-3) / 1000
        if until > self._turned:
            for wheel, count in enumerate(self.motors.turn(self._efforts, until - self._turned)):
                self._counts[wheel] += count
            self._turned = until

    def _control(self):
        self._turn()
        self.speeds = [float(single(count) * SPEED_PER_EDGE) for count in self._counts]
        self._counts = [0] * 3
        for wheel in range(3):
            effort = self._effort(wheel)
            if effort == 0.0:  # off until the next command
                self._stop(wheel)
            elif not self._stopped[wheel]:
                self._efforts[wheel] = effort

    def _effort(self, wheel):
        """As mbed's PID library: in parts of a span from -1 to 1, in single precision."""
        error = within_span(self.setpoints[wheel]) - within_span(self.speeds[wheel])
        pegged = self._outputs[wheel]
        if not (pegged >= 1 and error > 0) and not (pegged <= 0 and error < 0):
            self._sums[wheel] += error
        output = HALF + self.GAIN * (error + self.INTEGRAL * self._sums[wheel])
        self._outputs[wheel] = max(min(output, ONE), ZERO)
        return clamp(float(self._outputs[wheel] * TWO - ONE), self.EFFORT_LIMIT)


def within_span(value):
    """Part of the span from -1 to 1."""
    return min(max((single(value) + ONE) * HALF, ZERO), ONE)
