"""Slip seen by a gyro: the turn of the wheels against its turn. Turns are counterclockwise, in [rad]."""

import math
from collections import deque

from robotont_driver.odometry.chi_square import chi_square_limit
from robotont_driver.odometry.slip_by_wheels import TOLERANCE, WINDOW
from robotont_driver.odometry.wheel_noise import PATH_VARIANCE, LearntNoise

TIMING = 0.016          # [s] by which the times of gyro and wheels differ (standard deviation)
SLIPPING = 1.5          # a wheel slips by at most this part of its path
BRAKING = 0.8           # a wheel brakes when the newer half of its path is shorter than this part of the older


class TurnWatch:
    """Detects when the turn of the wheels is not that of the gyro: a wheel slips, or the robot is moved from outside.

    gyro: a `Gyro`. false_alarms: per hour at most. For n >= 3 wheels.
    """

    def __init__(self, gyro, false_alarms):
        self._gyro = gyro
        self._limit = chi_square_limit(min(0.5, false_alarms * gyro.period / 3600.0), 1)
        self.noise = LearntNoise(WINDOW)
        self._hold = 0      # packets until the alarm ends
        self.suspects = ()  # wheels of which one slips; all of them: the robot is pushed, lifted or carried
        self.alarms = 0

    def use_wheels(self, turn_per_edge):
        """From now on one edge of each wheel turns the robot by `turn_per_edge`, n [rad]."""
        self._per_edge = turn_per_edge
        self._edges = PATH_VARIANCE * sum(turn ** 2 for turn in turn_per_edge)  # [rad^2] at both ends
        self.forget()

    def forget(self):
        """Begin a new window, after a gap in the gyro's samples."""
        self._window = deque(maxlen=WINDOW)
        self._difference = self._variance = self._turn = 0.0
        self._path = [0] * len(self._per_edge)
        if not self._hold:
            self.suspects = ()

    def rest(self):
        """No gyro to compare with."""
        self._hold = 0
        self.forget()

    def update(self, counts, turn, difference, variance):
        """Take one packet; whether there is an alarm.

        counts: n. turn: [rad] by the gyro; difference: [rad] by which it exceeds that of the wheels; variance: [rad^2]
        of the wheels' turn, but for the ends of the path.
        """
        if len(self._window) == WINDOW:
            old_counts, old_turn, old_difference, old_variance = self._window[0]
            self._difference -= old_difference
            self._variance -= old_variance
            self._turn -= old_turn
            self._path = [path - count for path, count in zip(self._path, old_counts)]
        self._window.append((counts, turn, difference, variance))
        self._difference += difference
        self._variance += variance
        self._turn += turn
        self._path = [path + count for path, count in zip(self._path, counts)]
        rolls = self._variance_of_rolling()
        if self._difference ** 2 > self._limit * (rolls + self._tolerance()):
            self.alarms += not self.suspects
            self.suspects = self._suspected()
            self._hold = WINDOW
        elif self._hold:
            self._hold -= 1
            if not self._hold:
                self.suspects = ()
        elif self.noise.wants(self._path):
            self.noise.learn(self._difference ** 2 / rolls)
        return bool(self.suspects)

    def _variance_of_rolling(self):
        """[rad^2] of the difference over the window, of wheels that roll."""
        gyro, lasted = self._gyro, len(self._window) * self._gyro.period
        return (self._edges + self.noise.excess * self._variance + len(self._window) * gyro.noise
                + gyro.bias_variance * lasted ** 2 + gyro.scale_variance * self._turn ** 2)

    def _tolerance(self):
        """[rad^2] for wrong parameters of the wheels, and stamps of the gyro that are off."""
        ends = [turn - part for _, turn, difference, _ in (self._window[0], self._window[-1])
                for part in (0.0, difference)]  # of gyro and wheels, in a period
        faster = (max(ends) - min(ends)) / self._gyro.period  # [rad/s]
        return (TIMING * faster) ** 2 + sum(
            (TOLERANCE * turn * path) ** 2 for turn, path in zip(self._per_edge, self._path))

    def _suspected(self):
        """The wheels that can have slipped alone: that turn too fast, or, when they brake, too slowly."""
        suspects = []
        half = len(self._window) // 2
        for wheel, (turn, path) in enumerate(zip(self._per_edge, self._path)):
            slip = -self._difference / turn if turn else math.inf  # [edges] more than the wheel rolled
            older = sum(packet[0][wheel] for packet in list(self._window)[:half])
            brakes = abs(path - older) < BRAKING * abs(older)
            longest = SLIPPING * max(abs(path), 2 * abs(older) if brakes else 0)
            if abs(slip) <= longest and (slip * older < 0 if brakes else slip * path > 0):
                suspects.append(wheel)
        return tuple(suspects) or tuple(range(len(self._per_edge)))
