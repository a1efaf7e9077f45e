"""Wheels that slip, are blocked or do not as commanded: n wheels and a gyro measure more than a motion's three numbers.

A residual test, ten times a second: what remains of the paths of 0.5 s [m] without the motion that fits best. A wheel
that alone explains it, by the commands too, is out, but never one of three; else nobody is.
"""

import math

import numpy as np

from robotont_driver.kinematics.kinematics import LARGEST_CONDITION, condition
from robotont_driver.odometry.odometry import PATH_VARIANCE

BLOCK, WINDOW, RECENT, LONG = 0.1, 5, 10, 15  # [s]; blocks of a test; compared with commands; behind their change
BEHIND = 8              # blocks in which a change of the turning rate shows in a gyro's turn
LAG = 0.06              # [s] of the motors behind their commands; they may have none, and twice as much
WRONG = 0.01            # share of a path by which the wheel parameters may be wrong
FOLLOWED = 0.05, 0.005  # share of the path commanded, and [m], by which a motor may not follow
UNKNOWN = 1e6           # variance of what was not measured
ODDS = 9.0              # difference of squared residuals from which on the larger one is believed: 90 to 1
LASTS = 2 / 3           # of the limit must remain without its longest block: one jump is none
CLEAR, PROVEN = 2.0, 0.3  # [sigma] below which a wheel rolls again, once a slip by that share would have shown
MISSING = 0.009, 0.3, 5.0  # that a wheel may be off in 1 s untold: [m]; of the path commanded; of what it lags behind
FIRST, LEAST, MOST = (4.0, 0.0), (1 / 9, 0.0), 16.0  # variances over `wheel_noise` squared, own and common; bounds
DRIVEN, TRUST, MEMORY = 0.02, 6, 600  # [m] in a window that teaches them; windows that FIRST counts for; remembered


class SlipSearch:
    """Finds the wheel that does not roll as the others do. kinematics: of all n wheels; period: [s] of a packet.

    limit: [sigma] of a residual; 0: no search. `slipping`: the wheel that is excluded, or none. `alike`: those of which
    one slips; n: the gyro, so the robot is moved from outside. `slips`: n variances [edges^2] of a packet's paths then.
    `lagging`: wheels that do not turn as commanded. `noise`: learnt variances over `wheel_noise` squared, of each
    wheel's own and of what all have in common, as over a rough floor.
    """

    def __init__(self, kinematics, period, wheel_noise, limit):
        self._inverse, self.wheels = kinematics.inverse, kinematics.wheels.amount
        self._rows = np.vstack([kinematics.matrix, (0.0, 0.0, 1.0), kinematics.matrix])  # wheels, gyro, commands
        self._spare = [self.wheels > 3 and condition(np.delete(kinematics.matrix, wheel, 0)) <= LARGEST_CONDITION
                       for wheel in range(self.wheels)]
        self._edge, self._noise = np.array(kinematics.wheels.metres_per_edge), wheel_noise
        self._limit = math.sqrt(limit ** 2 + 2 * math.log(max(1, self.wheels - 3))) if limit else math.inf
        self._size, keep = max(1, round(BLOCK / period)), math.exp(-period / LAG)
        powers = np.arange(self._size)  # what motors do in a block's packets: by what they did, and by its commands
        self._decay, self._follow = keep ** (powers[:, None] + 1), np.tril(
            (1 - keep) * keep ** np.subtract.outer(powers, powers))
        self._packets, self._expected = [], np.zeros((1, self.wheels))
        self._blocks, self._turns = np.zeros((0, 4, self.wheels)), np.zeros((0, 3))  # of LONG blocks at most
        self.noise, self._learnt = np.array(FIRST), TRUST * np.eye(2) * max(1, self.wheels - 3)
        self._tests, self._shown, self._known = 0, 0.0, 0
        self.slipping, self.alike, self.slips, self.lagging, self.alarms = (), (), None, (), 0

    def update(self, counts, commanded=None, gyro=None):
        """Take n counts, the n units commanded or None, `Gyro.compared`; whether `slipping` or `alike` has changed."""
        self._packets.append((counts, commanded, gyro or (0.0, UNKNOWN, 0.0)))
        if len(self._packets) < self._size:
            return False
        (counts, commands, turns), self._packets = zip(*self._packets), []
        self._known = 0 if None in commands else self._known + 1
        follows = commands if self._known else counts
        block, self._expected = self.block(np.array(counts), np.array(follows), self._expected)
        blocks = self._blocks = np.concatenate([self._blocks[1 - LONG:], block[None]])
        turns = self._turns = np.concatenate([self._turns[1 - LONG:], np.array(turns).sum(axis=0)[None]])
        before = self.slipping, self.alike
        self._compare(blocks)
        if self.wheels > 3 or turns[-WINDOW:, 1].min() < UNKNOWN:
            self.judge(*self.measure(blocks, turns, self._known, self.noise))
        else:  # nothing checks three wheels
            self.alike, self.slips = (), None
        return (self.slipping, self.alike) != before

    def block(self, counts, commands, expected):
        """(4 x n [m]: counted, to and fro, commanded behind the lag, and beyond it; 1 x n that motors did last).

        counts, commands: of a block's packets x n [edges]. All may have leading axes: many robots of a kind at once.
        """
        expected = self._decay * expected + self._follow @ commands
        paths = np.concatenate([counts, np.abs(counts), expected, commands - expected], axis=-1).sum(axis=-2)
        return paths.reshape(*paths.shape[:-1], 4, self.wheels) * self._edge, expected[..., -1:, :]

    def _compare(self, blocks):
        path, _, commanded, _ = blocks[-RECENT:].sum(axis=0)
        allowed = MISSING[0] + MISSING[1] * abs(commanded) + MISSING[2] * abs(blocks[:, 3]).sum(axis=0)
        self.lagging = tuple((abs(path - commanded) > allowed).nonzero()[0].tolist() if self._known >= RECENT else ())

    def measure(self, blocks, turns, known, noise):
        """What `judge` takes, of b blocks: b x 4 x n as by `block`, b x 3 of a gyro; known: those with commands."""
        n, change = self.wheels, np.ptp(blocks[..., -BEHIND:, 0, :] @ self._inverse[2], axis=-1)
        blocks, turns = blocks[..., -WINDOW:, :, :], turns[..., -WINDOW:, :]
        path, _, commanded, lag = np.moveaxis(blocks.sum(axis=-3), -2, 0)
        counted, way = blocks[..., 0, :], blocks[..., 1, :]
        way = np.maximum(way, abs(counted @ (self._rows[:n] @ self._inverse).T))  # one that counts little is no better
        rough = self._noise * np.sqrt(way)
        turned = counted @ self._inverse[2] + turns[..., 0]
        values = np.concatenate([counted, turned[..., None], blocks[..., 2, :]], axis=-1)
        turn = turns[..., 1].sum(axis=-1) + (turns[..., 2].max(axis=-1) / self._size * change / BLOCK) ** 2
        follows = (FOLLOWED[0] * commanded) ** 2 + FOLLOWED[1] ** 2 + n * lag ** 2 + UNKNOWN * (known < WINDOW)
        turn = np.where(turn > 0.0, turn, UNKNOWN)[..., None]  # it has told nothing yet
        variances = [PATH_VARIANCE * self._edge ** 2 + (WRONG * path) ** 2, turn, follows]
        covariance = np.concatenate(variances, axis=-1)[..., None] * np.eye(2 * n + 1)
        own, common = np.moveaxis(noise, -1, 0)[..., None, None]
        covariance[..., :n, :n] += np.swapaxes(rough, -1, -2) @ rough * (own * np.eye(n) + common)
        return (path, rough, values, covariance, *_residuals(
            self._rows[:n + 1], values[..., :n + 1], covariance[..., :n + 1, :n + 1]))

    def judge(self, path, rough, values, covariance, parts, errors, weights):
        """Exclude, name, or take back a wheel by what `measure` gave; learn of those that roll."""
        self.alike, self.slips, self._tests = (), None, self._tests + 1
        n, sigmas = self.wheels, parts.sum(axis=0)
        worst = np.argmax(abs(sigmas))
        if self.slipping:
            self._release(sigmas, errors, path)
        elif abs(sigmas[worst]) > self._limit and min(abs(sigmas[worst] - parts[:, worst])) > LASTS * self._limit:
            self._accuse(_residuals(self._rows, values, covariance)[0].sum(axis=0)[:n + 1] ** 2, sigmas * errors)
        elif self._tests % WINDOW == 0 and np.sum(rough ** 2) >= n * DRIVEN * self._noise ** 2 and sigmas[:n].any():
            self._learn(rough * math.sqrt(self.noise.sum()), (sigmas / errors)[:n], weights[:n, :n])

    def _learn(self, rough, pulls, weights):
        """A step of Fisher's scoring for the noise, by the likelihood of the residuals."""
        both = np.vstack([np.diag(np.sqrt(np.sum(rough ** 2, axis=0))), rough])  # of each wheel, of each block
        expected, parts = both @ weights @ both.T, (0, self.wheels)
        self._learnt *= 1 - 1 / MEMORY
        self._learnt += np.add.reduceat(np.add.reduceat(expected ** 2, parts), parts, axis=1)
        pull = np.add.reduceat((both @ pulls) ** 2 - np.diag(expected), parts)
        steps, least = np.linalg.solve(self._learnt, pull), -self.noise[1] / self.noise.sum()
        if steps[1] < least:  # nothing is in common: all else is the wheels' own
            steps = np.array(((pull[0] - self._learnt[0, 1] * least) / self._learnt[0, 0], least))
        self.noise = np.clip(self.noise + self.noise.sum() * steps, LEAST, MOST)

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
        """Include the wheel again once it has rolled as the others do for so long that a slip would have shown."""
        wheel, = self.slipping
        shown = PROVEN * (path[wheel] / errors[wheel] - sigmas[wheel])
        self._shown = self._shown + shown ** 2 / WINDOW if abs(sigmas[wheel]) < CLEAR else 0.0
        if self._shown > self._limit ** 2:
            self.slipping = ()


def _residuals(rows, values, covariance):
    """(b x m, m, m x m): residuals of b x m values in deviations, [m] that each is too long for one, their weights.

    W. Baarda, A Testing Procedure for Use in Geodetic Networks (1968). rows: m x 3, of what measures a motion; 0 where
    nothing checks one. All but rows may have leading axes.
    """
    inverse = np.linalg.inv(covariance)
    weighed = inverse @ rows
    weights = inverse - weighed @ np.linalg.solve(rows.T @ weighed, np.swapaxes(weighed, -1, -2))
    variances, spare = (np.diagonal(each, axis1=-2, axis2=-1) for each in (covariance, weights))
    spare = spare * variances
    errors = np.sqrt(variances / np.maximum(spare, 1e-3))
    return values @ weights * (errors * (spare > 1e-3))[..., None, :], errors, weights


def values_of(search):
    """Values for the diagnostics, by name."""
    return {"wheels excluded": list_wheels(search.slipping) or "none", "wheels found so far": search.alarms,
            "noise of the wheels, learnt": f"{math.sqrt(search.noise.sum()):.1f} x wheel_noise"}


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
