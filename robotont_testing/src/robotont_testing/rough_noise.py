"""A third generator: stalls, FTDI chips, motors' lag, noise of other laws, gyros that are wrong.

From physics and from what users found; its author knew the modules that are tested. SI units; K periods of a drive,
each a twist (v_x, v_y, omega) in base_link.
"""

import math

import numpy as np

from robotont_testing import other_noise

FINE = 4       # parts of a period in which wheels roll
FIRST = 0.001  # [s] least delay of a packet


def joystick(seconds, rng, stops=0.2, speed=0.4, turn=1.2):
    """Twists that a person wishes, as `other_noise.joystick` has them before the motors."""
    parts, total = [], 0.0
    while total < seconds:
        stick = np.clip(rng.normal(0, 0.7, 3), -1, 1) * (rng.random(3) < 0.6) * (rng.random() > stops)
        parts.append((0.3 + rng.exponential(1.2), stick * (speed, speed, turn)))
        total += parts[-1][0]
    return np.concatenate([np.tile(twist, (max(1, round(length / other_noise.PERIOD)), 1)) for length, twist in parts])


def followed(wished, lag=0.08):
    """Twists of a body whose motors follow with a lag [s] of the first order."""
    keep = math.exp(-other_noise.PERIOD / lag) if lag else 0.0
    now, out = np.zeros(3), np.empty_like(wished)
    for index, goal in enumerate(wished):
        now = keep * now + (1 - keep) * goal
        out[index] = now
    return out


def counts(wheels, twists, rng, noise, slip=None, common=0.0, heavy=False):
    """Edges per period and wheel, K x n integers; as `other_noise.counts`.

    common: share of the variance that all wheels have in common. heavy: Student's law with 3 degrees of freedom.
    """
    rows = np.array([(math.cos(angle), math.sin(angle), lever)
                     for angle, lever in zip(wheels.directions, wheels.levers)])
    rolled = np.repeat(twists @ rows.T, FINE, axis=0) * (other_noise.PERIOD / FINE)

    def drawn(shape):
        return rng.standard_t(3, shape) / math.sqrt(3) if heavy else rng.standard_normal(shape)
    random = math.sqrt(1 - common) * drawn(rolled.shape) + math.sqrt(common) * drawn((len(rolled), 1))
    way = rolled if slip is None else rolled * (1 + np.repeat(slip, FINE, axis=0))
    ways = np.cumsum(way + noise * np.sqrt(np.abs(rolled)) * random, axis=0)[FINE - 1::FINE]
    seen = np.floor(rng.uniform(-2, 2, rolled.shape[1]) + ways / np.array(wheels.metres_per_edge)).astype(int)
    return np.diff(seen, axis=0, prepend=seen[:1])


def arrivals(number, rng, period=0.02, drift=0.0, jitter=0.0015, late=0.0, lost=0.0, burst=1, stalls=(), timer=0.0,
             handling=0.0003, restarts=0):
    """(ends of periods, arrivals [s]; packets' numbers; which arrive), on a machine that takes `handling` for each.

    late: share that waits up to 30 ms more. lost: share that begins a loss of `burst`. stalls: (begin, length) in which
    nothing is taken. timer: of an FTDI chip or a poll. restarts: of the board, which takes 1.3 s and numbers from 0.
    """
    ends, numbers = np.arange(1, number + 1) * period * (1 + drift), np.arange(number)
    for start in np.linspace(0, number, restarts + 2).astype(int)[1:-1]:
        ends[start:] += 1.3 + rng.uniform(0, period)
        numbers[start:] -= numbers[start]
    come = np.ones(number, dtype=bool)
    for start in np.flatnonzero(rng.random(number) < lost):
        come[start:start + burst] = False
    times = ends + FIRST + rng.exponential(jitter, number) + rng.uniform(0, 0.03, number) * (rng.random(number) < late)
    if timer:
        times = np.ceil(times / timer) * timer
    for begin, length in stalls:
        times[(times >= begin) & (times < begin + length)] = begin + length
    queue = handling * np.arange(number)  # each waits for those before it
    return ends, np.maximum.accumulate(times - queue) + queue, numbers, come


def gyro(twists, rng, hertz=200.0, scale=1.0, unit=1.0, about=1.0, most=np.inf, dropouts=0.0, stamped=0.0, late=0.0,
         clock=0.0, bias=0.01):
    """(stamps, rates, arrivals) of a gyro's samples; period k ends at (k + 1) 0.02 s.

    about: cosine between its axis and up. most: [rad/s] that it measures. stamped, late: [s] by which its stamps, and
    their arrivals, are late. clock: part by which its clock is fast.
    """
    times = np.arange(1, int(len(twists) * other_noise.PERIOD * hertz) + 1) / hertz
    turned = np.concatenate([[0.0], np.cumsum(twists[:, 2])]) * other_noise.PERIOD * about
    knots = np.arange(len(turned)) * other_noise.PERIOD
    rates = np.diff(np.interp(np.concatenate([[0.0], times]), knots, turned)) * hertz
    drift = bias * rng.standard_normal() + 2e-5 / math.sqrt(hertz) * np.cumsum(rng.standard_normal(len(times)))
    read = (rates * scale + drift + 1e-4 * math.sqrt(hertz) * rng.standard_normal(len(times))) * unit
    kept = np.ones(len(times), dtype=bool)
    for start in np.flatnonzero(rng.random(len(times)) < dropouts / hertz / 0.5):
        kept[start:start + 1 + int(rng.exponential(0.5) * hertz)] = False
    read = np.clip(np.round(read, 3), -most, most)
    return (times * (1 + clock) + stamped)[kept], read[kept], (times + 0.003 + late)[kept]
