"""Finds the wheel that slips, is blocked or does not as commanded: n wheels and a gyro measure more than a motion.

One residual test, ten times a second: what remains of the paths of 0.5 s [m] without the motion that fits best. The
largest one is out, but never one of three wheels (W. Baarda, A Testing Procedure for Use in Geodetic Networks, 1968).
"""

import numpy as np

from robotont_driver.kinematics.kinematics import LARGEST_CONDITION, condition
from robotont_driver.odometry.odometry import PATH_VARIANCE

BLOCK, WINDOW, KEPT = 0.1, 5, 8  # [s]; blocks of a test; in which a change of the turning rate shows in a gyro's turn
WRONG, UNKNOWN = 0.01, 1e6  # share of a path by which wheel parameters may be wrong; variance of what was not measured
FOLLOWED = 0.05, 0.005      # share of a path commanded, and [m], by which motors may be off; they lag a block at most
ODDS, LASTS = 9.0, 2 / 3    # between two squared residuals, 90 to 1; of the limit without the longest block: no jump
CLEAR, PROVEN = 2.0, 0.3    # [sigma] below which a wheel rolls again, once a slip by that share would have shown
FIRST, LEAST, MOST, COMMON = 4.0, 0.25, 40.0, 0.6  # `noise`, its bounds; share of it that all wheels have in common
DRIVEN, TRUST, MEMORY, OUTLIER = 0.02, 15, 1500, 9  # [m] that teach it; tests for FIRST, in all; most `fit`


class SlipSearch:
    """Finds the wheel that does not roll as the others do. kinematics: of all n wheels; period: [s] of a packet.

    limit: [sigma] of a residual; 0: no search. `slipping`: the wheel that is excluded, or none. `alike`: those of which
    one slips; n: the gyro, so the robot is moved from outside. `slips`: n variances [edges^2] of a packet's paths then.
    `lagging`: the wheel that does not turn as commanded. `noise`: running variance over that by `wheel_noise`.
    """

    def __init__(self, kinematics, period, wheel_noise, limit):
        n = self.wheels = kinematics.wheels.amount
        self._rows = np.vstack([kinematics.matrix, (0.0, 0.0, 1.0), kinematics.matrix])  # wheels, gyro, commands
        self._spare = [condition(np.delete(self._rows[:n], one, 0)) <= LARGEST_CONDITION for one in range(n)] + [False]
        self._inverse, self._edge = kinematics.inverse, np.array(kinematics.wheels.metres_per_edge)
        self._wheel_noise, self._size = wheel_noise, max(1, round(BLOCK / period))
        self._limit = np.sqrt(limit ** 2 + 2 * np.log(max(1, n - 3))) if limit else np.inf
        self._packets, self._blocks = [], np.zeros((KEPT, 2 * n + 4))  # it stood before
        self.noise, self._learnt, self._shown = FIRST, TRUST, 0.0
        self.slipping, self.alike, self.slips, self.lagging = (), (), None, ()

    def update(self, counts, commanded=None, gyro=None):
        """Take n counts, the n units commanded or None, `Gyro.compared`; whether `slipping` or `alike` has changed."""
        self._packets.append((*counts, *(commanded or counts), commanded is None, *(gyro or (0.0, UNKNOWN, 0.0))))
        if len(self._packets) < self._size:
            return False
        self._blocks, self._packets = np.vstack([self._blocks[1:], np.sum(self._packets, axis=0)]), []
        before, self.alike, self.slips, self.lagging = (self.slipping, self.alike), (), None, ()
        self._test(*self._measure())
        return before != (self.slipping, self.alike)

    def _measure(self):
        """(values of n wheels [m], gyro [rad], n commands [m] by block, their covariance, [m] that the wheels went)."""
        n, (unknown, beyond, turn, timing) = self.wheels, self._blocks[:, 2 * self.wheels:].T
        paths, commands = self._blocks[:, :n] * self._edge, self._blocks[:, n:2 * n] * self._edge
        steps, late = paths @ self._inverse.T, np.roll(commands, 1, axis=0)
        values = np.column_stack([paths, steps[:, 2] + beyond, (commands + late) / 2])[-WINDOW:]
        (path, _, commanded), lag = np.split(values.sum(axis=0), (n, n + 1)), (commands - late)[-WINDOW:].sum(axis=0)
        # one that counts little is no better
        way = np.maximum(abs(paths), abs(steps @ self._rows[:n].T))[-WINDOW:].sum(axis=0)
        rough = self._wheel_noise * np.sqrt(self.noise * way)
        turn = turn[-WINDOW:].sum() + (timing[-1] / self._size * np.ptp(steps[:, 2]) / BLOCK) ** 2
        covariance = np.diag(np.concatenate([
            PATH_VARIANCE * self._edge ** 2 + (WRONG * path) ** 2, [turn or UNKNOWN],
            (FOLLOWED[0] * commanded) ** 2 + FOLLOWED[1] ** 2 + n * (lag / 2) ** 2 + UNKNOWN * unknown.sum()]))
        covariance[:n, :n] += COMMON * np.outer(rough, rough) + (1 - COMMON) * np.diag(rough ** 2)
        return values, covariance, way

    def _test(self, values, covariance, way):
        n = self.wheels
        by_all, _ = residuals(self._rows, values, covariance)
        parts, errors = residuals(self._rows[:n + 1], values[:, :n + 1], covariance[:n + 1, :n + 1])
        sigmas, path = parts.sum(axis=0), values.sum(axis=0)[:n + 1]
        if self.slipping:
            wheel, = self.slipping
            shown = PROVEN * (path / errors - sigmas)[wheel]
            self._shown = self._shown + shown ** 2 / WINDOW if abs(sigmas[wheel]) < CLEAR else 0.0
            self.slipping = self.slipping if self._shown <= self._limit ** 2 else ()
        elif self._beyond(parts).any():
            squares = by_all.sum(axis=0)[:n + 1] ** 2  # which explains all better than any other, the commands, too
            accused = tuple(np.flatnonzero(squares > squares.max() - ODDS).tolist())
            if len(accused) == 1 and self._spare[accused[0]]:
                self.slipping, self._shown = accused, 0.0
            else:
                self.alike = accused
                self.slips = ((sigmas * errors)[:n] ** 2 / self._edge ** 2 / (WINDOW * self._size)).tolist()
        else:
            worst = int(np.argmax(abs(by_all.sum(axis=0)[:n])))
            # half the limit: the rest is FOLLOWED
            self.lagging = (worst,) if self._beyond(2 * by_all)[worst] and _others_do(values[-2:], worst, n) else ()
            freedom = n - 3 + (covariance[n, n] < UNKNOWN)
            if freedom and way.mean() > DRIVEN:
                fit = min(OUTLIER, (path * sigmas / errors).sum() / freedom)  # 1 where `noise` is right
                self.noise = min(max(self.noise + self.noise * (fit - 1.0) / self._learnt, LEAST), MOST)
                self._learnt = min(self._learnt + 0.5, MEMORY)

    def _beyond(self, parts):
        sigmas = parts.sum(axis=0)
        return (abs(sigmas) > self._limit) & (abs(sigmas - parts).min(axis=0) > LASTS * self._limit)


def _others_do(values, wheel, n):
    """Whether the others turn about as commanded, or stand as such, unlike a robot's that rolls on, or stands."""
    paths, commands = (abs(part.sum(axis=0)) for part in (values[:, :n], values[:, -n:]))
    path, asked = (np.delete(part, wheel).sum() for part in (paths, commands))
    return 0.85 * asked < path < 1.5 * asked or path + asked < paths[wheel] / 10


def residuals(rows, values, covariance):
    """(b x m: residuals of b x m values, in deviations; m: [m] that each is too long for one). rows: m x 3."""
    inverse = np.linalg.inv(covariance)
    weighed = inverse @ rows
    weights = inverse - weighed @ np.linalg.solve(rows.T @ weighed, weighed.T)
    errors = 1.0 / np.sqrt(np.maximum(np.diag(weights), 1e-3 / np.diag(covariance)))  # nothing checks one: no residual
    return values @ weights * errors, errors
