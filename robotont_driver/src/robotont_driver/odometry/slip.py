"""Wheels that slip, are blocked or do not as commanded: n wheels and a gyro measure more than a motion's three numbers.

A residual test over 0.5 s, ten times a second: what remains of the paths without the motion that fits them best. The
wheel with the largest residual is out. Where several explain it alike the commands decide, or nobody. Paths in [m].
"""

import math
from collections import deque

import numpy as np

from robotont_driver.kinematics.kinematics import LARGEST_CONDITION, condition
from robotont_driver.odometry.odometry import PATH_VARIANCE

BLOCK, WINDOW, SECOND, LONG = 0.1, 5, 10, 15  # [s]; blocks of a test; compared with commands; behind their change
BEHIND = 8              # blocks in which a change of the turning rate shows in a gyro's turn
LAG = 0.06              # [s] of the motors behind their commands; they may have none, and twice as much
WRONG = 0.01            # share of a path by which the wheel parameters may be wrong
FOLLOWED = 0.05, 0.005  # share of the path commanded, and [m], by which a motor may not follow
MORE = 1.3              # times the limit for more than four wheels, among which noise in common shows
UNKNOWN = 1e6           # variance of what was not measured
ODDS = 9.0              # difference of squared residuals from which on the larger one is believed: 90 to 1
CLEAR, PROVEN = 2.0, 0.3  # [sigma] below which a wheel rolls again, once a slip by that share would have shown
MISSING = 0.009, 0.3, 5.0  # [m], share of the path commanded for 1 s, and times LAG, that a wheel may lack untold
FIRST, BOUNDS = 2.0, (1 / 3, 4.0)  # noise of the wheels over `wheel_noise`: until it has been learnt; always
DRIVEN, TRUST, MEMORY = 0.02, 6, 600  # [m] in a window that teaches it; windows that FIRST counts for; remembered


class SlipSearch:
    """Finds the wheel that does not roll as the others do. kinematics: of all n wheels; period: [s] of a packet.

    wheel_noise: as in WheelOdometry. limit: [sigma] of a residual; 0: no search. `slipping`: the wheel that is
    excluded, or none. `alike`: those of which one slips; n: the gyro, so the robot is moved from outside. `slips`: n
    variances [edges^2] of a packet's paths then. `lagging`: wheels that do not turn as commanded.
    """

    def __init__(self, kinematics, period, wheel_noise, limit):
        self._inverse, self.wheels = kinematics.inverse, kinematics.wheels.amount
        self._rows = np.vstack([kinematics.matrix, (0.0, 0.0, 1.0), kinematics.matrix])  # wheels, gyro, commands
        self._spare = [self.wheels > 3 and condition(np.delete(kinematics.matrix, wheel, 0)) <= LARGEST_CONDITION
                       for wheel in range(self.wheels)]
        self._edge, self._noise = np.array(kinematics.wheels.metres_per_edge), wheel_noise
        self._limit = (limit or math.inf) * (MORE if self.wheels > 4 else 1.0)
        self._size, keep = max(1, round(BLOCK / period)), math.exp(-period / LAG)
        powers = np.arange(self._size)  # what motors do in a block's packets: by what they did, and by its commands
        self._decay, self._follow = keep ** (powers[:, None] + 1), np.tril(
            (1 - keep) * keep ** np.subtract.outer(powers, powers))
        self._blocks, self._packets, self._expected = deque(maxlen=LONG), [], np.zeros(self.wheels)
        self.ratio, self._learnt, self._tests, self._shown, self._known = FIRST, TRUST, 0, 0.0, 0
        self.slipping, self.alike, self.slips, self.lagging, self.alarms = (), (), None, (), 0

    def update(self, counts, commanded=None, gyro=None):
        """Take n counts, the n units commanded (None: unknown), and what a gyro's turn adds (`Gyro.compared`).

        Whether `slipping` or `alike` has changed.
        """
        self._packets.append((counts, commanded, gyro or (0.0, UNKNOWN, 0.0)))
        if len(self._packets) < self._size:
            return False
        (counts, commands, turns), self._packets = zip(*self._packets), []
        self._known = 0 if None in commands else self._known + 1
        counts = np.array(counts)
        commands = np.array(commands) if self._known else counts
        expected = self._decay * self._expected + self._follow @ commands
        self._expected = expected[-1]
        paths = np.array((counts, np.abs(counts), expected, commands - expected)).sum(axis=1)
        self._blocks.append((paths * self._edge, np.array(turns).sum(axis=0)))
        before = self.slipping, self.alike
        self._test(*map(np.array, zip(*self._blocks)))
        return (self.slipping, self.alike) != before

    def _test(self, blocks, gyro):
        """blocks: b x 4 x n paths as counted, to and fro, commanded behind the lag, and beyond it; gyro: b x 3."""
        n, known, change = self.wheels, self._known, np.ptp(blocks[-BEHIND:, 0] @ self._inverse[2])
        path, _, commanded, _ = blocks[-SECOND:].sum(axis=0)
        allowed = MISSING[0] + MISSING[1] * abs(commanded) + MISSING[2] * abs(blocks[:, 3]).sum(axis=0)
        self.lagging = tuple(np.flatnonzero(abs(path - commanded) > allowed).tolist() if known >= SECOND else ())
        blocks, gyro = blocks[-WINDOW:], gyro[-WINDOW:]
        path, way, commanded, lag = blocks.sum(axis=0)
        self.alike, self.slips, self._tests = (), None, self._tests + 1
        if not (way.any() or gyro[:, 0].any()):
            return
        way = np.maximum(way, abs(self._rows[:n] @ (self._inverse @ path)))  # a wheel that counts little is no better
        wheels = PATH_VARIANCE * self._edge ** 2 + (self.ratio * self._noise) ** 2 * way + (WRONG * path) ** 2
        turn = gyro[:, 1].sum() + (gyro[:, 2].max() / self._size * change / BLOCK) ** 2
        follows = (FOLLOWED[0] * commanded) ** 2 + FOLLOWED[1] ** 2 + n * lag ** 2 + UNKNOWN * (known < WINDOW)
        values = np.column_stack([blocks[:, 0], blocks[:, 0] @ self._inverse[2] + gyro[:, 0], blocks[:, 2]])
        rows, variances = self._rows, np.concatenate([wheels, [turn], follows])
        parts, errors = _residuals(rows[:n + 1], values[:, :n + 1], variances[:n + 1])
        sigmas = parts.sum(axis=0)
        worst = np.argmax(abs(sigmas))
        lasts = min(abs(sigmas[worst] - parts[:, worst]))  # without its longest block: one jump is no slip
        if self.slipping:
            self._release(sigmas, errors, path)
        elif abs(sigmas[worst]) > self._limit and lasts > self._limit / 2:
            self._accuse(_residuals(rows, values, variances)[0].sum(axis=0)[:n + 1] ** 2, sigmas * errors)
        elif self._tests % WINDOW == 0 and way.mean() >= DRIVEN and sigmas[:n].any():  # all roll: learn the noise
            self._learnt = min(self._learnt + 1, MEMORY)
            ratio = self.ratio * math.sqrt(1.0 + (np.mean(sigmas[:n] ** 2) - 1.0) / self._learnt)
            self.ratio = min(max(ratio, BOUNDS[0]), BOUNDS[1])

    def _accuse(self, squares, slips):
        """Exclude the wheel that explains all (squared residuals) better than any other, or name those alike."""
        alike = np.flatnonzero(squares > squares.max() - ODDS).tolist()
        self.alarms += 1
        if len(alike) == 1 and alike[0] < self.wheels and self._spare[alike[0]]:
            self.slipping, self._shown = tuple(alike), 0.0
            return
        self.alike = tuple(alike)
        accused = [wheel in alike or alike == [self.wheels] for wheel in range(self.wheels)]
        self.slips = ((slips[:-1] * accused / self._edge) ** 2 / (WINDOW * self._size)).tolist()

    def _release(self, sigmas, errors, path):
        """Include the wheel again that rolls as the others do, for as long as a slip would have shown."""
        wheel, = self.slipping
        shown = PROVEN * (path[wheel] / errors[wheel] - sigmas[wheel])
        self._shown = self._shown + shown ** 2 / WINDOW if abs(sigmas[wheel]) < CLEAR else 0.0
        if self._shown > self._limit ** 2:
            self.slipping = ()


def _residuals(rows, values, variances):
    """(b x m, m): the residuals of m values in deviations, by block; [m] that each would be too long for one of them.

    rows: m x 3, of what measures a motion. Those that nothing checks have none.
    """
    root = 1 / np.sqrt(variances)
    scaled = rows * root[:, None]
    remains = np.eye(len(rows)) - scaled @ np.linalg.solve(scaled.T @ scaled, scaled.T)
    spare = np.diag(remains)
    checked, spare = spare > 1e-3, np.sqrt(np.maximum(spare, 1e-3))
    return (values * root) @ remains * (checked / spare), 1 / (spare * root)


def values_of(search):
    """Values for the diagnostics, by name."""
    return {"wheels excluded": list_wheels(search.slipping) or "none", "wheels found so far": search.alarms,
            "noise of the wheels, learnt": f"{search.ratio:.1f} x wheel_noise"}


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
