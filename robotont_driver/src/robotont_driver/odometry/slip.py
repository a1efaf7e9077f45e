"""Wheels that slip or are blocked: n wheels, and a gyro, measure more than the three numbers of a motion.

A residual test over 0.5 s, ten times a second: what remains of the paths without the motion that fits them best. Of
wheels that explain it alike the commands decide, behind the motors' lag; or nobody, and that is told. Paths are in [m].
"""

import math
from collections import deque
from statistics import NormalDist

import numpy as np

from robotont_driver.kinematics.kinematics import LARGEST_CONDITION, condition
from robotont_driver.odometry.odometry import PATH_VARIANCE

BLOCK, WINDOW, LONG, SECOND = 0.1, 5, 15, 10  # [s]; blocks of a test; behind a change; compared with the commands
BEHIND = 8        # blocks in which a change of the turning rate shows in a gyro's turn
LAG = 0.06        # [s] of the motors behind their commands; they may have none, and twice as much
OVERLAP = 3.0     # windows that overlap complain together, so many times more seldom than others
WRONG = 0.01      # share of a path by which the wheel parameters may be wrong
FOLLOWED = 0.05, 0.005  # share of the path commanded, and [m], by which a motor may not follow
ODDS = 9.0        # difference of two costs from which on the likelier is believed: 90 to 1
CLEAR, PROVEN = 2.0, 0.3  # [sigma] below which a wheel rolls again, once a slip by that share would have shown
MISSING = 0.009, 0.3, 5.0  # [m], share of the path commanded for 1 s, and times LAG, that a wheel may lack untold
TRUST, MEMORY = 6, 600  # [windows of 0.5 s] that the first guess counts for; in which noise is learnt: 5 min
DRIVEN = 0.02           # [m] mean way of the wheels in a window that says something about it
FIRST, BOUNDS = 2.0, (1 / 3, 4.0)  # times `wheel_noise`: until it has been learnt; always


class LearntNoise:
    """The noise of the wheels, learnt while all roll: `variance` [m^2 per m], `ratio` of its root to what is stated."""

    def __init__(self, wheel_noise):
        self._stated, self._learnt, self.ratio = wheel_noise, TRUST, FIRST

    @property
    def variance(self):
        """[m^2 per m] of the way."""
        return (self.ratio * self._stated) ** 2

    def learn(self, ratio, way):
        """Take a window's statistic over its expectation by the noise as learnt, and the wheels' mean way [m] in it."""
        if way >= DRIVEN:
            self._learnt = min(self._learnt + 1, MEMORY)
            ratio = self.ratio * math.sqrt(max(0.0, 1.0 + (ratio - 1.0) / self._learnt))
            self.ratio = min(max(ratio, BOUNDS[0]), BOUNDS[1])


class SlipSearch:
    """Finds the wheel that does not roll as the others do. kinematics: of all n wheels; period: [s] of a packet.

    wheel_noise: as in WheelOdometry, learnt from twice that on. false_alarms: per hour of driving; 0: no search.
    """

    def __init__(self, kinematics, period, wheel_noise, false_alarms):
        self._inverse, self.wheels = kinematics.inverse, kinematics.wheels.amount
        self._rows = np.vstack([kinematics.matrix, (0.0, 0.0, 1.0)])  # the gyro measures the turn
        self._spare = [self.wheels > 3 and condition(np.delete(kinematics.matrix, wheel, 0)) <= LARGEST_CONDITION
                       for wheel in range(self.wheels)]
        self._edge = np.array(kinematics.wheels.metres_per_edge)
        several = self.wheels if self.wheels > 4 else 1  # of four, all explain it alike
        rate = min(0.2, false_alarms * OVERLAP * BLOCK / 7200.0 / several)
        self._limit = -NormalDist().inv_cdf(rate) if rate else math.inf
        self._size, keep = max(1, round(BLOCK / period)), math.exp(-period / LAG)
        # how what the motors do in each packet of a block follows from what they did before, and from its commands
        self._decay = keep ** np.arange(1, self._size + 1)
        self._follow = (1 - keep) * np.tril(keep ** np.subtract.outer(np.arange(self._size), np.arange(self._size)))
        self._expected, self._known = np.zeros(self.wheels), 0  # [edges] in a period by the commands; known for blocks
        self._blocks, self._tests, self._shown = deque(maxlen=LONG), 0, 0.0
        self.noise = LearntNoise(wheel_noise)
        self.slipping = ()  # the wheel that is excluded, or none
        self.alike = ()     # of which one slips, and nobody knows which; n: the gyro: the robot is moved from outside
        self.slips = None   # n [edges^2]: variance of a packet's paths then
        self.lagging, self.followed = (), None  # wheels not as commanded; shares of the path, None: hardly commanded
        self.alarms = 0
        self._packets = []  # of a block

    def update(self, counts, commanded=None, gyro=None):
        """Take n counts, the n units commanded (None: unknown), and what a gyro's turn adds (GyroFusion.compared).

        Whether `slipping` or `alike` has changed.
        """
        self._packets.append((counts, commanded, gyro or (0.0, math.inf, 0.0)))
        if len(self._packets) < self._size:
            return False
        (counts, commands, turns), self._packets = zip(*self._packets), []
        self._known = 0 if None in commands else self._known + 1
        counts, commands = np.array(counts), np.array(commands if self._known else np.zeros_like(counts))
        expected = self._decay[:, None] * self._expected + self._follow @ commands
        self._expected = expected[-1]
        sums = counts.sum(axis=0), abs(counts).sum(axis=0), expected.sum(axis=0), (commands - expected).sum(axis=0)
        self._blocks.append((sums * self._edge, np.sum(turns, axis=0)))
        before = self.slipping, self.alike
        blocks, turns = map(np.array, zip(*self._blocks))
        self._test(blocks[-WINDOW:], turns[-WINDOW:], np.ptp(blocks[-BEHIND:, 0] @ self._inverse[2]) / BLOCK)
        self._compare_with_commands(blocks)
        return (self.slipping, self.alike) != before

    def _test(self, blocks, gyro, change):
        turns = blocks[:, 0] @ self._inverse[2]
        path, way, expected, lag = blocks.sum(axis=0)
        way = np.maximum(way, abs(self._rows[:-1] @ (self._inverse @ path)))  # one that counts little is no better
        variance = np.append(PATH_VARIANCE * self._edge ** 2 + self.noise.variance * way,
                             gyro[:, 1].sum() + (gyro[:, 2].max() / self._size * change) ** 2)
        used = self.wheels + math.isfinite(variance[-1])
        self.alike, self.slips = (), None
        if used == 3 or len(blocks) < WINDOW:
            return
        paths, rows = np.column_stack([blocks[:, 0], turns + gyro[:, 0]])[:, :used], self._rows[:used]
        root = 1 / np.sqrt(variance + (WRONG * np.append(path, 0.0)) ** 2)[:used]
        inverse, remains = _fit(rows, root)
        spare = np.diag(remains)
        share = np.where(spare > 1e-3, remains / np.sqrt(np.maximum(spare, 1e-3)), 0.0)  # of wheel i in column i
        parts = (paths * root) @ share
        sigmas = parts.sum(axis=0)
        worst = np.argmax(abs(sigmas))
        slips = sigmas / np.sqrt(np.maximum(spare, 1e-3)) / root  # by how much each would be too long
        if self.slipping:
            self._release(sigmas, spare, root, abs(path - slips[:self.wheels]))
            return
        lasts = min(abs(sigmas[worst] - parts[:, worst]))  # without its longest block: one jump is no slip
        self._tests += 1
        if abs(sigmas[worst]) > self._limit and lasts > self._limit / 2:
            motions = inverse @ (rows.T @ (paths.sum(axis=0) * root ** 2))
            self._accuse(rows * root[:, None], motions, inverse, spare, sigmas, slips, expected, lag)
        elif self._tests % WINDOW == 0:
            plain = 1 / np.sqrt(variance)[:used]
            scaled = paths.sum(axis=0) * plain
            self.noise.learn(scaled @ _fit(rows, plain)[1] @ scaled / (used - 3), way.mean())

    def _accuse(self, rows, motion, inverse, spare, sigmas, slips, expected, lag):
        """Exclude the wheel that explains the residual better than any other and the gyro, or name those alike."""
        late = self._inverse @ lag
        follows = (FOLLOWED[0] * expected) ** 2 + FOLLOWED[1] ** 2
        uncertain = (self._inverse * follows) @ self._inverse.T + np.outer(late, late)
        costs = np.where(spare > 1e-3, -sigmas ** 2, np.inf)
        for index in np.flatnonzero(spare > 1e-3) if self._known >= WINDOW else ():
            pull = inverse @ rows[index]  # the motion without this wheel, against the one that was commanded
            off = motion - pull * sigmas[index] / math.sqrt(spare[index]) - self._inverse @ expected
            costs[index] += off @ np.linalg.solve(inverse + np.outer(pull, pull) / spare[index] + uncertain, off)
        alike = np.flatnonzero(costs < costs.min() + ODDS).tolist()
        self.alarms += 1
        if len(alike) == 1 and alike[0] < self.wheels and self._spare[alike[0]]:
            self.slipping, self._shown = tuple(alike), 0.0
            return
        self.alike = tuple(alike)
        wheels = [index in alike or alike == [self.wheels] for index in range(self.wheels)]
        self.slips = ((slips[:self.wheels] * wheels / self._edge) ** 2 / (WINDOW * self._size)).tolist()

    def _release(self, sigmas, spare, root, others):
        """Include the wheel again that rolls as the `others` [m] do, for as long as a slip would have shown."""
        wheel, = self.slipping
        shown = PROVEN ** 2 * (others[wheel] * root[wheel]) ** 2 * spare[wheel] / WINDOW
        self._shown = self._shown + shown if abs(sigmas[wheel]) < CLEAR else 0.0
        if self._shown > self._limit ** 2:
            self.slipping = ()

    def _compare_with_commands(self, blocks):
        """Which wheels do not do as commanded."""
        self.lagging, self.followed = (), None
        if self._known < SECOND:
            return
        path, _, expected, _ = blocks[-SECOND:].sum(axis=0)
        allowed = MISSING[0] + MISSING[1] * abs(expected) + MISSING[2] * abs(blocks[:, 3]).sum(axis=0)
        self.lagging = tuple(np.flatnonzero(abs(path - expected) > allowed).tolist())
        self.followed = [did / wanted if abs(wanted) > MISSING[0] else None for did, wanted in zip(path, expected)]


def _fit(rows, root):
    """Covariance (3 x 3) of the motion that fits measurements by `rows` (m x 3) best, by weights root^2; I - hat."""
    scaled = rows * root[:, None]
    inverse = np.linalg.inv(scaled.T @ scaled)
    return inverse, np.eye(len(rows)) - scaled @ inverse @ scaled.T


def values_of(search):
    """Values for the diagnostics, by name."""
    values = {
        "wheels excluded": list_wheels(search.slipping) or "none",
        "wheels found so far": search.alarms,
        "noise of the wheels, learnt": f"{search.noise.ratio:.1f} x wheel_noise",
    }
    for wheel, share in enumerate(search.followed or ()):
        values[f"wheel {wheel}: part of the commanded path"] = "at rest" if share is None else f"{share:.0%}"
    return values


def fault_of_wheels(search):
    """The gravest fault; empty when there is none."""
    if search.slipping:
        return (f"{list_wheels(search.slipping)} disagrees with the others and is excluded from the odometry: look for "
                "a slipping or blocked wheel, a loose coupling, an unplugged encoder")
    if search.alike:
        wheels = [wheel for wheel in search.alike if wheel < search.wheels]
        moved = "the robot is pushed, lifted or carried" if len(wheels) < len(search.alike) else ""
        slips = f"{'one of ' if len(wheels) > 1 else ''}{list_wheels(wheels)} slips or is blocked" if wheels else ""
        return " or ".join(filter(None, (moved, slips))) + ": the odometry goes on with all, its covariance grows"
    if search.lagging:
        does = "does" if len(search.lagging) == 1 else "do"
        return (f"{list_wheels(search.lagging)} {does} not turn as commanded: look for a blocked wheel, a loose motor "
                "or encoder cable, an empty battery")
    return ""


def list_wheels(wheels):
    """Wheels by index, as text; empty for none."""
    *first, last = map(str, wheels) if wheels else [""]
    return "wheels " + ", ".join(first) + " and " + last if first else last and "wheel " + last
