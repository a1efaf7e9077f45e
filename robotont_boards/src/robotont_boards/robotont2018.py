"""The firmware of June 2018."""

import re

from robotont_boards.virtual_board import BYTE, Board, clamp


class Robotont2018Board(Board):
    """The firmware of June 2018. Unit: edges per 10 ms. There is no time-out; the loop lasts 20 ms and its writing."""

    FULL_SCALE = 100
    GAIN, INTEGRAL_TIME, CONTROL_PERIOD = 0.5, 0.25, 0.01
    BUFFER = 254
    _COMMAND = re.compile(rb"\s*([+-]?\d+)(?::\s*([+-]?\d+)(?::\s*([+-]?\d+))?)?")

    def __init__(self, motors, start=0.0):
        super().__init__(motors, start)
        self.setpoints = [0] * 3
        self.counts = [0] * 3
        self._stopped = [True] * 3
        self._sums = [0.0] * 3
        self._buffer = bytearray()
        self._loops = 0
        self._every(self.CONTROL_PERIOD, self._control, self.CONTROL_PERIOD)
        self._every(0.02, self._loop, 0.003)

    def _on_bytes(self, byte):
        self._buffer.append(byte)
        if len(self._buffer) > self.BUFFER:
            self._buffer.clear()
        if byte == 13:
            match = self._COMMAND.match(bytes(self._buffer))
            for wheel, field in enumerate(match.groups() if match else ()):
                if field is not None:
                    self.setpoints[wheel] = int(field)
            self.executed.append((self.now, bytes(self._buffer).strip()))
            self._stopped = [False] * 3
            self._buffer.clear()
        if byte == 27:
            self.setpoints = [0] * 3
            self._stopped = [True] * 3
            self._sums = [0.0] * 3
            self._buffer.clear()

    def _control(self):
        efforts = [0.0 if self._stopped[wheel] else self._effort(wheel) for wheel in range(3)]
        self.counts = self.motors.turn(efforts, self.CONTROL_PERIOD)

    def _effort(self, wheel):
        error = (self.setpoints[wheel] - self.counts[wheel]) / self.FULL_SCALE
        self._sums[wheel] += error
        return clamp(self.GAIN * (error + self._sums[wheel] * self.CONTROL_PERIOD / self.INTEGRAL_TIME), 1.0)

    def _loop(self):
        text = b"Temperatures 21.5:21.5:22.0\r\n" if self._loops % 10 == 0 else b""
        self._loops += 1
        text += b"Setpoints %d:%d:%d\r\n" % tuple(self.setpoints)
        text += b"Encoders %d:%d:%d\r\n\r\n" % tuple(self.counts)
        self._outgoing.append(text)
        self._schedule[1][0] += len(text) * BYTE  # writing takes the processor
