"""Wheels that slip, are blocked or count nothing: detected by parity checks, and by comparison with the command.

With n > 3 wheels the counts are redundant: the wheel matrix J leaves n - 3 combinations of them (parity checks)
that are zero while every wheel rolls. A chi-square test compares them with their noise over a short window. With
three wheels nothing is redundant; there, and for any n, commanded and measured paths are compared. Counts and
paths of wheels are in edges.
"""

import itertools
import math
from collections import deque

import numpy as np

from robotont_driver.solvers import LARGEST_CONDITION, condition, least_squares, parity
from robotont_driver.wheel_noise import PATH_VARIANCE, variance_per_edge

WINDOW = 10             # [packets with motion] that the test looks back on: 0.2 s at 50 Hz
TOLERANCE = 0.01        # wheel parameters are taken to be right within this part of a wheel's path
PREDICTION = 0.3        # relative error of the predicted motion; decides only where parity cannot
DOUBT = 6.0             # wheels whose costs differ by less (odds of 20 to 1) are almost equally suspect ...
PATIENCE = 3            # ... which is tolerated for so many packets
CLEAR = 0.05            # an excluded wheel is included again when clean counts would look worse this often ...
PROVEN = 0.3            # ... and a slip of this part of its path would have been detected


class SlipDetector:
    """Finds which of n >= 4 wheels do not roll consistently with the others.

    matrix: n x 3 wheel matrix. metres_per_edge: n [m]. wheel_noise: standard deviation [m] of a wheel's
    path after 1 m. false_alarms: how often per hour of driving clean counts may raise an alarm, at
    `frequency` [Hz] packets per second; an upper bound, as the tests of neighbouring packets overlap.
    """

    def __init__(self, matrix, metres_per_edge, wheel_noise, false_alarms, frequency):
        self._matrix = np.asarray(matrix)
        self._edge = np.array(metres_per_edge)
        self._noise = variance_per_edge(wheel_noise, self._edge)
        self._rate = min(0.5, false_alarms / (3600.0 * frequency))
        self._views = {}
        self._counts = deque(maxlen=WINDOW)
        self._commands = deque(maxlen=WINDOW)
        self._path = np.zeros(len(matrix))   # [edges] over the window
        self._good = deque(maxlen=WINDOW)    # such paths while there was no complaint
        self._doubts = 0                     # packets for which two wheels have been almost equally suspect
        self.slipping = ()                   # indices of the excluded wheels, ascending
        self.alarms = 0                      # how many times a wheel was excluded

    def update(self, counts, commanded=None):
        """Take one packet: n counts, and the n units commanded for it (None: unknown).

        Returns whether `slipping` has changed. A packet of a robot at rest contains no information and is ignored.
        """
        counts = np.array(counts, dtype=float)
        if not counts.any():
            return False
        full = len(self._counts) == WINDOW
        self._path = self._path + (counts - self._counts[0] if full else counts)
        self._counts.append(counts)
        self._commands.append(commanded)
        before = self.slipping
        if before:
            self._release()
        view = self._view(self.slipping)
        if view.limit is None or self._statistic(view) <= view.limit:
            self._doubts = 0
            if not self.slipping:
                self._good.append(self._path)
        else:
            self._accuse()
        return self.slipping != before

    def _accuse(self):
        """Exclude the smallest set of wheels that makes the rest consistent; break ties by likelihood.

        While two wheels are almost equally suspect, wait for a few more packets.
        """
        amount = len(self._path)
        for number in range(1, amount - 2):
            suspects = sorted(
                (self._cost(wheels), wheels) for wheels in itertools.combinations(range(amount), number)
                if self._can_spare(wheels))
            if not suspects:
                return
            cost, wheels = suspects[0]
            view = self._view(wheels)
            if view.limit is None or self._statistic(view) <= view.limit:
                # where the rest is not redundant, waiting would add no information
                doubtful = view.limit is not None and len(suspects) > 1 and suspects[1][0] - cost < DOUBT
                self._doubts += 1
                if not doubtful or self._doubts > PATIENCE:
                    self.alarms += len(set(wheels) - set(self.slipping))
                    self.slipping = wheels
                    self._doubts = 0
                return

    def _release(self):
        """Include each wheel again that has rolled consistently with the others for the whole window."""
        if len(self._counts) < WINDOW:
            return
        for wheel in self.slipping:
            rest = tuple(other for other in self.slipping if other != wheel)
            view = self._view(rest)
            # path of this wheel that follows from the others; whether a slip of a part of it would have been detected
            expected = self._matrix[wheel] @ (self._view(self.slipping).solution @ (self._path * self._edge))
            slip = np.zeros(len(self._path))
            slip[wheel] = PROVEN * expected / self._edge[wheel]
            if self._statistic(view) <= view.clear and self._statistic(view, slip) > view.limit:
                self.slipping = rest

    def _cost(self, wheels):
        """How badly the counts fit without these `wheels`.

        The sum of the parity test of the rest and of the distance between their motion and the expected one.
        """
        view = self._view(wheels)
        cost = self._statistic(view) if view.limit is not None else 0.0
        expected = self._expected() * self._edge
        length = expected @ expected
        if length:
            moved = self._matrix @ (view.solution @ (self._path * self._edge))
            # any speed will do (motors lag behind their command), not any direction
            share = min(max(moved @ expected / length, 0.0), 1.5)
            cost += np.sum((moved - share * expected) ** 2) / (PREDICTION ** 2 * length)
        return cost

    def _expected(self):
        """[edges] path that was commanded over the window; without commands, the one before the complaint."""
        commands = [commanded for commanded in self._commands if commanded is not None]
        path = np.sum(commands, axis=0) if commands else np.zeros(len(self._path))
        if path.any() or not self._good:
            return path
        return self._good[0]

    def parity_test(self, excluded=()):
        """(statistic, degrees of freedom) of the newest window's parity checks without the `excluded` wheels.

        Chi-square distributed while the wheels in use roll.
        """
        view = self._view(tuple(excluded))
        return self._statistic(view), len(view.parity)

    def _statistic(self, view, path=None):
        """Squared parity checks of a path [edges] (that of the window when None) over their covariance."""
        driven = self._path
        variances = PATH_VARIANCE + self._noise * np.abs(driven) + (TOLERANCE * driven) ** 2
        checks = view.parity @ (driven if path is None else path)
        if len(checks) == 1:
            return float(checks[0] ** 2 / (view.squares @ variances)[0])
        return float(checks @ np.linalg.solve((view.parity * variances) @ view.parity.T, checks))

    def _can_spare(self, wheels):
        """Whether the other wheels still determine every motion."""
        return condition(self._matrix[self._view(wheels).wheels]) <= LARGEST_CONDITION

    def _view(self, excluded):
        if excluded not in self._views:
            self._views[excluded] = _View(self._matrix, self._edge, excluded, self._rate)
        return self._views[excluded]


class _View:
    """The wheels in use when some are excluded: their solution and, of more than three, their parity checks."""

    def __init__(self, matrix, edge, excluded, rate):
        self.wheels = [wheel for wheel in range(len(matrix)) if wheel not in excluded]
        self.solution = least_squares(matrix, self.wheels)
        self.parity = parity(matrix, self.wheels) * edge  # of edges
        self.squares = self.parity ** 2
        degrees = len(self.wheels) - 3
        self.limit = chi_square_limit(rate, degrees) if degrees else None
        self.clear = chi_square_limit(CLEAR, degrees) if degrees else None


class CommandWatch:
    """Compares commanded and measured paths of n >= 3 wheels, over about a second.

    frequency: [Hz] packets per second. Motors lag behind their commands, so each change of command
    excuses a difference of `LAG` times the change.
    """

    BLOCK = 0.1        # [s]
    BLOCKS = 10        # blocks in a window ...
    EARLIER = 5        # ... and before it, from which changes of command still show
    LAG = 0.3          # [s] in which a motor may follow
    SHARE = 0.3        # part of the commanded path by which a wheel may differ
    LEAST = 50.0       # [edges] by which it may differ always: motors have a least speed

    def __init__(self, wheels, frequency):
        self._packets = max(1, round(self.BLOCK * frequency))
        self._lag = self.LAG * frequency  # [packets]
        self._blocks = deque(maxlen=self.BLOCKS + self.EARLIER)
        self._last = None
        self._wheels = wheels
        self._start_block()
        self.followed = None  # per wheel: measured over commanded path of the newest window; None: hardly commanded
        self.lagging = ()     # indices of the wheels that do not follow their command

    def update(self, counts, commanded):
        """Take one packet: n counts and the n units commanded for it (None: unknown, starts again)."""
        if commanded is None:
            if self._last is not None:
                self._blocks.clear()
                self._start_block()
                self._last = None
                self.followed, self.lagging = None, ()
            return
        measured, path = self._measured, self._path
        for wheel in range(self._wheels):
            measured[wheel] += counts[wheel]
            path[wheel] += commanded[wheel]
        if commanded != self._last:
            for wheel, old in enumerate(self._last or [0.0] * self._wheels):
                self._change[wheel] += abs(commanded[wheel] - old)
            self._last = commanded
        self._left -= 1
        if not self._left:
            self._blocks.append((measured, path, self._change))
            self._start_block()
            if len(self._blocks) >= self.BLOCKS:
                self._judge()

    def _start_block(self):
        self._left = self._packets
        self._measured = [0.0] * self._wheels
        self._path = [0.0] * self._wheels      # commanded
        self._change = [0.0] * self._wheels

    def _judge(self):
        measured, commanded, change = (np.array(part) for part in zip(*self._blocks))
        measured, commanded = measured[-self.BLOCKS:].sum(axis=0), commanded[-self.BLOCKS:].sum(axis=0)
        allowed = self.LEAST + self.SHARE * abs(commanded) + self._lag * change.sum(axis=0)
        self.followed = tuple(
            float(did / wanted) if abs(wanted) > self.LEAST else None for did, wanted in zip(measured, commanded))
        self.lagging = tuple(np.flatnonzero(abs(measured - commanded) > allowed).tolist())


def chi_square_tail(value, degrees):
    """Probability that a chi-square variable of `degrees` (a whole number > 0) of freedom exceeds `value`.

    The upper incomplete gamma function of a half-integer, which is a finite sum. scipy.special has it too (the tests
    compare), but would cost odom_node 0.14 s of its start and 14 MB, and the robot 62 MB of disk, for these lines.
    """
    half = value / 2
    tail = math.erfc(math.sqrt(half)) if degrees % 2 else 0.0
    power = 0.5 if degrees % 2 else 0.0
    while power < degrees / 2:
        tail += math.exp(-half) * half ** power / math.gamma(power + 1)
        power += 1
    # the odd sum runs over 1/2, 3/2, ... below degrees / 2; the even one over 0, 1, ...
    return tail


def chi_square_limit(rate, degrees):
    """The value that a chi-square variable of `degrees` of freedom exceeds with probability `rate` (0 to 1)."""
    low, high = 0.0, 10.0
    while chi_square_tail(high, degrees) > rate and high < 1e3:
        high *= 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if chi_square_tail(middle, degrees) > rate else (low, middle)
    return high
