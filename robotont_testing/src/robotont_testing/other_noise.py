"""A second generator of drives and of what sensors make of them, from physics alone.

Written by somebody who had not read slip, gyro and odometry_stamps, for the figures of docs/figures.md; nothing here
is shared with simulated_wheels. SI units; K periods of a drive, each a twist (v_x, v_y, omega) in base_link.
"""

import math

import numpy as np

PERIOD = 0.02  # [s] of the board
FINE = 4       # parts of a period in which wheels roll
# of the gyro: samples [Hz], noise [rad/s/sqrt(Hz)], deviation of the bias and step of a reading [rad/s]
GYRO_RATE, DENSITY, BIAS, STEP = 100.0, 1e-4, 0.01, 0.001


def _followed(wished, lag=0.08):
    """Twists of a body that follows the wished ones as motors do, first order with `lag` [s]."""
    keep = math.exp(-PERIOD / lag)
    out, now = np.empty_like(wished), np.zeros(3)
    for index, goal in enumerate(wished.tolist()):
        now = keep * now + (1 - keep) * np.array(goal)
        out[index] = now
    out[np.abs(out) < 1e-4] = 0.0
    return out


def _stretches(parts):
    """Wished twists from (seconds, twist) pairs."""
    return np.concatenate([np.tile(np.array(twist, dtype=float), (max(1, round(seconds / PERIOD)), 1))
                           for seconds, twist in parts])


def joystick(seconds, rng, speed=0.4, turn=1.2, stops=0.2):
    """A person at the stick: one axis, two or three at once, for 0.3 to 4 s each; a part of them stands."""
    parts, total = [], 0.0
    while total < seconds:
        stick = np.clip(rng.normal(0, 0.7, 3), -1, 1) * (rng.random(3) < 0.6) * (rng.random() > stops)
        parts.append((0.3 + rng.exponential(1.2), stick * (speed, speed, turn)))
        total += parts[-1][0]
    return _followed(_stretches(parts)[:round(seconds / PERIOD)])


def squares(side=1.0, rounds=1, speed=0.3, turn=1.0):
    """Squares: each side ahead, each corner on the spot, each with a short stop behind it."""
    legs = [(side / speed, (speed, 0, 0)), (0.5, (0, 0, 0)), (math.pi / 2 / turn, (0, 0, turn)), (0.5, (0, 0, 0))]
    return _followed(_stretches(legs * 4 * rounds))


def circles(radius=0.5, rounds=1, speed=0.3):
    """Circles in one go."""
    seconds = 2 * math.pi * radius / speed * rounds
    return _followed(_stretches([(0.5, (0, 0, 0)), (seconds, (speed, 0, speed / radius)), (1.0, (0, 0, 0))]))


def counts(wheels, twists, rng, noise=0.0, slip=None):
    """Edges per period and wheel, K x n integers.

    noise: standard deviation [m] of a rim's way after 1 m, a walk of its own per wheel, in the way. slip: K x n further
    shares of the way that a rim turns without rolling.
    """
    rows = np.array([(math.cos(a), math.sin(a), lever)
                     for a, lever in zip(wheels.directions, wheels.levers)])
    rolled = np.repeat(twists @ rows.T, FINE, axis=0) * (PERIOD / FINE)
    way = rolled if slip is None else rolled * (1 + np.repeat(slip, FINE, axis=0))
    way = way + noise * np.sqrt(np.abs(rolled)) * rng.standard_normal(rolled.shape)
    ways = np.cumsum(way, axis=0)[FINE - 1::FINE]
    seen = np.floor(rng.uniform(-2, 2, rolled.shape[1]) + ways / np.array(wheels.metres_per_edge)).astype(int)
    return np.diff(seen, axis=0, prepend=seen[:1])


def gyro(twists, rng, walk=2e-5, scale=0.0, dropouts=0.0, axis=2):
    """(stamps [s], rates [rad/s]) of an integrating gyro about one axis, in packets' time: period k ends at (k+1)·0.02.

    walk of the bias [rad/s/sqrt(s)], scale: error of the rate, -2 is a wrong sign. dropouts: share of the time in gaps
    of some 0.5 s. axis: 2 is up; 0 or 1 sees no turning.
    """
    each = 1.0 / GYRO_RATE
    times = np.arange(1, int(len(twists) * PERIOD / each) + 1) * each + rng.uniform(0, each)
    times = times[times <= len(twists) * PERIOD]
    knots = np.arange(len(twists) + 1) * PERIOD
    turned = np.concatenate([[0.0], np.cumsum(twists[:, 2])]) * PERIOD * (axis == 2)
    true = np.diff(np.interp(np.concatenate([[times[0] - each], times]), knots, turned)) / each
    drift = BIAS * rng.standard_normal() + walk * math.sqrt(each) * np.cumsum(rng.standard_normal(len(times)))
    read = true * (1 + scale) + drift + DENSITY * math.sqrt(GYRO_RATE) * rng.standard_normal(len(times))
    kept = np.ones(len(times), dtype=bool)
    for start in np.flatnonzero(rng.random(len(times)) < dropouts * each / 0.5):
        kept[start:start + 1 + int(rng.exponential(0.5) * GYRO_RATE)] = False
    return times[kept], (np.round(read / STEP) * STEP)[kept]


def arrivals(number, rng, drift=0.0, jitter=0.0015, late=0.01, lost=0.0, burst=1):
    """(ends of periods [s], times of arrival [s], which arrive) of `number` packets; the board's clock drifts.

    Transport takes 2 ms and an exponential `jitter`; a share `late` waits up to 30 ms more; packets stay in order.
    lost: share of packets that begin a loss of `burst` packets.
    """
    ends = np.arange(1, number + 1) * PERIOD * (1 + drift)
    wait = 0.002 + rng.exponential(jitter, number) + rng.uniform(0, 0.03, number) * (rng.random(number) < late)
    come = np.ones(number, dtype=bool)
    for start in np.flatnonzero(rng.random(number) < lost):
        come[start:start + burst] = False
    return ends, np.maximum.accumulate(ends + wait), come
