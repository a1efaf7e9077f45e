"""Wheels that slip, are blocked or count nothing, found by the others: n > 3 wheels count more than a motion.

A chi-square test over a short and a long window; its statistic is the weighted sum of squares that remains of the
wheels' paths when the step that fits them best is taken off. See docs/odometry.md. Counts and paths are in edges.
"""

import itertools
from collections import deque

import numpy as np

from robotont_driver.kinematics.least_squares import LARGEST_CONDITION
from robotont_driver.odometry.chi_square import chi_square_limit
from robotont_driver.odometry.wheel_noise import PATH_VARIANCE, LearntNoise, variance_per_edge

WINDOW = 10             # [packets with motion] that the tests look back on: 0.2 s at 50 Hz, ...
WINDOWS = WINDOW, 50    # ... and 1 s
OVERLAP = 2.0, 4.0      # windows that overlap complain together, at least so many times more seldom than others
TOLERANCE = 0.01        # wheel parameters are taken to be right within this part of a wheel's path
PREDICTION = 0.3        # relative error of the predicted motion; decides only where parity cannot
DOUBT = 6.0             # wheels whose costs differ by less (odds of 20 to 1) are almost equally suspect ...
PATIENCE = 3            # ... which is tolerated for so many packets
ALL_SUBSETS = 6         # wheels up to which every set of them is tried as the slipping ones; ...
LARGEST_SET = 2         # ... of more wheels every set up to this size, and the likeliest with one wheel more, and more
CLEAR = 0.05            # an excluded wheel is included again when clean counts would look worse this often ...
PROVEN = 0.3            # ... and a slip of this part of its path would have been detected, in one window, or ...
SEVERAL = 2.0           # ... in several together, which takes this many times as much
FIRST = 2.0             # times `wheel_noise`: the noise until it has been learnt


class SlipDetector:
    """Finds which of n >= 4 wheels do not roll consistently with the others.

    matrix: n x 3 wheel matrix. metres_per_edge: n [m]. wheel_noise: about the standard deviation [m] of a wheel's
    path after 1 m, which is learnt while all roll. false_alarms: how often per hour of driving clean counts may raise
    an alarm, at `frequency` [Hz] packets per second.
    """

    def __init__(self, matrix, metres_per_edge, wheel_noise, false_alarms, frequency):
        self._matrix = np.asarray(matrix)
        self._edge = np.array(metres_per_edge)
        self._noise = variance_per_edge(wheel_noise, self._edge)
        amount = len(self._matrix)
        rates = [min(0.5, false_alarms * overlap / len(WINDOWS) / (3600.0 * frequency)) for overlap in OVERLAP]
        # of the windows' statistics, by number of wheels in use; three are not redundant
        self._limits = {wheels: np.array([chi_square_limit(rate, wheels - 3) for rate in rates])
                        for wheels in range(4, amount + 1)}
        self._limits[3] = np.full(len(WINDOWS), np.inf)
        self._clear = {wheels: chi_square_limit(CLEAR, wheels - 3) for wheels in range(4, amount + 1)}
        self._products = np.einsum("ni,nj->nij", self._matrix, self._matrix).reshape(amount, 9)
        largest = amount - 3 if amount <= ALL_SUBSETS else LARGEST_SET
        self._sets = [self._prepare(itertools.combinations(range(amount), number)) for number in range(1, largest + 1)]
        self._all = np.ones((1, amount))
        self._used = self._all               # 1 for each wheel in use, 0 for those excluded
        self._paths = self._weights = None   # windows x n: paths [m], and the inverse of their variances
        self._sums = deque([np.zeros((2, amount))], maxlen=WINDOWS[-1] + 1)  # [edges] paths up to each packet, and ways
        self._commands = deque(maxlen=WINDOWS[-1])
        self._others = (others_matrix(self._matrix) * self._edge / self._edge[:, None]).T
        self._all_fitted = (self._matrix @ np.linalg.pinv(self._matrix) * self._edge / self._edge[:, None]).T
        self.noise = LearntNoise(WINDOW, FIRST)
        self._good = deque(maxlen=WINDOWS[-1])  # such paths [edges] while there was no complaint
        self._doubts = 0                     # packets for which two wheels have been almost equally suspect
        self._shown = np.zeros(amount)       # per excluded wheel: what its clean windows since would have shown
        self._coarse = False                 # whether the short window has excluded the newest of them
        self.slipping = ()                   # indices of the excluded wheels, ascending
        self.alarms = 0                      # how many times a wheel was excluded

    def update(self, counts, commanded=None):
        """Take one packet: n counts, and the n units commanded for it (None: unknown).

        Returns whether `slipping` has changed. A packet of a robot at rest contains no information and is ignored.
        """
        counts = np.array(counts, dtype=float)
        if not counts.any():
            return False
        self._sums.append(self._sums[-1] + (counts, np.abs(counts)))
        self._commands.append(commanded)
        paths, ways = self._windows()
        noise = self._noise_variances(paths, ways)
        self._paths, self._weights = paths * self._edge, 1.0 / ((noise + (TOLERANCE * paths) ** 2) * self._edge ** 2)
        before = self.slipping
        if before and len(self._sums) > WINDOW:
            self._release()
        complaints = self._complains(self.slipping, self._statistics(self._used * self._weights, self._paths))
        if not complaints.any():
            self._doubts = 0
            if not self.slipping:
                self._good.append(paths)
                self._learn(paths[0])
        else:
            self._accuse(int(np.argmax(complaints)))
        return self.slipping != before

    def _windows(self):
        """[edges], 2 x windows x n: paths and ways, to and fro, of the windows that end now."""
        return self._sums[-1][:, None] - np.stack(
            [self._sums[max(-window - 1, -len(self._sums))] for window in WINDOWS], axis=1)

    def _noise_variances(self, paths, ways):
        """[edges^2] of paths and ways [edges], windows x n.

        It grows with the way that a wheel has rolled; one that has counted little by its noise has that of the others.
        """
        return PATH_VARIANCE + self.noise.excess * self._noise * np.maximum(ways, np.abs(paths @ self._others))

    def _learn(self, path):
        """Learn the noise, without tolerance, which would hide it, and from the ways that fit all wheels best."""
        if self.noise.wants(path.tolist()):
            variances = PATH_VARIANCE + self.noise.excess * self._noise * np.abs(path @ self._all_fitted)
            weights = self._used / (variances * self._edge ** 2)
            self.noise.learn(self._statistics(weights, path * self._edge)[0] / (len(path) - 3))

    def _complains(self, excluded, statistics):
        """In which windows the wheels but the `excluded` ones do not roll consistently."""
        return statistics > self._limits[len(self._matrix) - len(excluded)]

    def _accuse(self, window):
        """Exclude the smallest set of wheels that makes the rest consistent in this window; break ties by likelihood.

        While two wheels are almost equally suspect, wait for a few more packets.
        """
        amount = len(self._matrix)
        expected = self._expected(window) * self._edge
        wheels = ()
        for number in range(1, amount - 2):
            sets, used = self._sets[number - 1] if number <= len(self._sets) else self._prepare(
                tuple(sorted((*wheels, other))) for other in range(amount) if other not in wheels)
            if not sets:
                return
            statistics, costs = self._compare(used, window, expected)
            if amount - number > 3:
                costs = costs + statistics
            first, *second = np.argsort(costs, kind="stable")[:2]
            wheels = sets[first]
            if not self._complains(wheels, statistics[first])[window]:
                # where the rest is not redundant, waiting would add no information
                doubtful = amount - number > 3 and any(costs[second] - costs[first] < DOUBT)
                self._doubts += 1
                if not doubtful or self._doubts > PATIENCE:
                    self.alarms += len(set(wheels) - set(self.slipping))
                    self._exclude(wheels)
                    self._coarse, self._doubts = window == 0, 0
                return

    def _exclude(self, wheels):
        self.slipping = wheels
        self._used = self._all.copy()
        self._used[0, list(wheels)] = 0.0
        self._shown = np.zeros(len(self._matrix))

    def _release(self):
        """Include a wheel again that has rolled consistently with the others, for as many clean windows as prove it.

        After a coarse slip the long window begins where the short one has become clean.
        """
        wheels = list(self.slipping)
        rows, in_use = range(len(wheels)), len(self._matrix) - len(wheels) + 1
        used = np.repeat(self._used, len(wheels), axis=0)
        used[rows, wheels] = 1.0
        short, clean = (self._statistics(used * weights, paths) <= self._clear[in_use]
                        for weights, paths in zip(self._weights, self._paths))
        while self._coarse and not short.all() and len(self._sums) > WINDOW:
            self._sums.popleft()
        # path of this wheel that follows from the others; how clearly a slip of a part of it would have shown
        steps, _ = self._fit(self._used, self._paths[-1])
        slips = np.zeros_like(used)
        slips[rows, wheels] = PROVEN * (self._matrix[wheels] @ steps[0])
        shown, limit = self._statistics(used * self._weights[-1], slips), self._limits[in_use][0]
        clean &= short
        self._shown[wheels] = np.where(clean, self._shown[wheels] + shown / (len(self._sums) - 1), 0.0)
        proven = clean & ((shown > limit) | (self._shown[wheels] > SEVERAL * limit))
        if proven.any():
            first = wheels[int(np.argmax(proven))]
            self._exclude(tuple(other for other in wheels if other != first))

    def _compare(self, used, window, expected):
        """(statistics, distances from the `expected` paths (n [m])), s each, with the wheels `used` (s x n)."""
        steps, remains = self._fit(np.concatenate((used * self._weights[window], used)), self._paths[window])
        length = expected @ expected
        if not length:
            return remains[:len(used)], np.zeros(len(used))
        moved = steps[len(used):] @ self._matrix.T
        # any speed will do (motors lag behind their command), not any direction
        share = np.clip(moved @ expected / length, 0.0, 1.5)
        return remains[:len(used)], ((moved - share[:, None] * expected) ** 2).sum(axis=1) / (PREDICTION ** 2 * length)

    def _expected(self, window):
        """[edges] path that was commanded over this window; without commands, the one before the complaint."""
        packets = min(WINDOWS[window], len(self._sums) - 1)
        commands = [commanded for commanded in list(self._commands)[-packets:] if commanded is not None]
        path = np.sum(commands, axis=0) if commands else np.zeros(len(self._matrix))
        if path.any() or not self._good:
            return path
        return self._good[max(-WINDOWS[window], -len(self._good))][window]

    def _statistics(self, weights, paths):
        """For each set of `weights` (s x n), of paths [m] (n or s x n): s."""
        return self._fit(weights, paths)[1]

    def _fit(self, weights, paths):
        """Steps (s x 3) that fit paths [m] best by `weights` (s x n), and the weighted sums of squares (s) that remain.

        paths: n, or s x n.
        """
        products = (weights @ self._products).reshape(-1, 3, 3)
        weighted = weights * paths
        projected = weighted @ self._matrix
        steps = np.linalg.solve(products, projected[:, :, None])[:, :, 0]
        return steps, (weighted * paths).sum(axis=1) - (projected * steps).sum(axis=1)

    def _prepare(self, sets):
        """Those of sets of wheels without which the others still determine every motion, and their `used` (s x n)."""
        sets = list(sets)
        used = np.ones((len(sets), len(self._matrix)))
        used[np.arange(len(sets))[:, None], sets] = 0.0
        scale = used @ np.abs(self._matrix[:, 2]) / used.sum(axis=1)  # turning taken at the wheels, as in `condition`
        products = (used @ self._products).reshape(-1, 3, 3)
        products[:, 2, :] /= scale[:, None]
        products[:, :, 2] /= scale[:, None]
        values = np.linalg.eigvalsh(products)
        spare = values[:, 2] <= LARGEST_CONDITION ** 2 * values[:, 0]
        return [wheels for wheels, spared in zip(sets, spare) if spared], used[spare]


def others_matrix(matrix):
    """Path of each wheel as it follows from those of the others, n x n; 0 where none of them tells."""
    fit = matrix @ np.linalg.pinv(matrix)
    spare = 1.0 - np.diag(fit)
    share = np.where(spare > 1e-6, 1.0 / np.maximum(spare, 1e-6), 0.0)
    return (fit - np.diag(np.diag(fit))) * share[:, None]
