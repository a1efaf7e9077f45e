"""Generation 2 and 2.1."""

import math
import re

from robotont_boards.virtual_board import (
    METRES_PER_EDGE,
    POSITIONS,
    TIME_OUT,
    Board,
    OfficialOdometry,
    atof,
    clamp,
    single,
)


class Robotont2Board(Board):
    """Generation 2 and 2.1 on its ST-LINK port. base_frame: firmware 2.1.3 or newer; distance: 0.127 before 2020.

    Every 10 ms the motors' control, every 20 ms the main loop, every 100 ms a look at the time-out.
    """

    SPEED_LIMIT = 0.3    # [m/s] of each wheel alone
    EFFORT_LIMIT = 0.25
    GAIN, INTEGRAL_TIME, CONTROL_PERIOD = 0.8, 0.05, 0.01
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
        self._sums = [0.0] * 3      # of the control errors
        self._buffer = bytearray()
        self._complete = False
        self._commanded_at = start
        self._send(b"**** MAIN ****\r\n")
        self._every(self.CONTROL_PERIOD, self._control, self.CONTROL_PERIOD)
        self._every(0.1, self._look_at_time, 0.1)
        self._every(0.02, self._loop, 0.003)

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
        numbers = [float(single(atof(field))) for field in fields[1:4]]
        if fields[0] == b"MS":
            for wheel, speed in enumerate(numbers):
                self._set_speed(wheel, speed)
        else:
            vx, vy, turn = numbers
            for wheel, phi in enumerate(POSITIONS):
                speed = math.hypot(vx, vy) * math.sin(math.atan2(vy, vx) - phi) + self._distance * turn
                if abs(speed) < 1e-5:
                    self._stop(wheel)
                else:
                    self._set_speed(wheel, speed)
        self._commanded_at = self.now

    def _set_speed(self, wheel, speed):
        if self._stopped[wheel]:
            self._sums[wheel] = 0.0
            self._stopped[wheel] = False
        self.setpoints[wheel] = clamp(speed, self.SPEED_LIMIT)

    def _stop(self, wheel):
        self._set_speed(wheel, 0.0)
        self._stopped[wheel] = True

    def _look_at_time(self):
        if self.now - self._commanded_at > TIME_OUT:
            for wheel in range(3):
                self._stop(wheel)

    def _control(self):
        efforts = [0.0 if self._stopped[wheel] else self._effort(wheel) for wheel in range(3)]
        for wheel, effort in enumerate(efforts):
            if effort == 0.0:  # off until the next command
                self._stop(wheel)
        counts = self.motors.turn(efforts, self.CONTROL_PERIOD)
        self.speeds = [count * METRES_PER_EDGE / self.CONTROL_PERIOD for count in counts]

    def _effort(self, wheel):
        error = self.setpoints[wheel] - self.speeds[wheel]
        self._sums[wheel] += error
        wanted = self.GAIN * (error + self._sums[wheel] * self.CONTROL_PERIOD / self.INTEGRAL_TIME)
        if abs(wanted) > 1.0:
            self._sums[wheel] -= error
        return clamp(wanted, self.EFFORT_LIMIT)
