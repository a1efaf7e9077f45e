"""A generator of drives, encoders, gyros and arrivals, written from physics by somebody who had not read odometry/.

It imports nothing of the product. Whoever uses it feeds the product packet by packet. Many drives at once: arrays are
(drives, periods, ...). Lengths in metres, angles in radians, times in seconds.
"""
import math

import numpy as np


class Base:
    """Omni wheels that stand evenly, or where `angles` says, each driving along its tangent, counterclockwise."""

    def __init__(self, wheels=4, distance=0.125, radius=0.035, edges=18.75 * 64, rate=50.0, angles=None):
        self.wheels, self.distance, self.radius, self.edges, self.rate = wheels, distance, radius, edges, rate
        at = np.arange(wheels) * 2 * math.pi / wheels + 0.3 if angles is None else np.asarray(angles, float)
        self.angles = at
        self.matrix = np.stack((-np.sin(at), np.cos(at), np.full(wheels, distance)), axis=1)
        self.edge = 2 * math.pi * radius / edges

    def thesis_keys(self):
        """The wheel parameters as a user would write them: driving directions from the reference direction."""
        return {"wheelAmount": self.wheels, "wheelRads": [float(a + math.pi / 2) for a in self.angles],
                "wheelDistanceFromCenter": self.distance, "wheelRadius": self.radius, "gearboxReductionRatio": 18.75,
                "encoderEdgesPerMotorRevolution": self.edges / 18.75, "pidControlFrequency": self.rate}


def commands(rng, drives, seconds, rate=50.0, speed=0.6, turn=2.0, slope=2.0, rests=0.15):
    """Twists (drives, periods, 3): rests, lines, spins, curves of 0.5 to 4 s; speeds change by `slope` [m/s^2]."""
    periods = int(round(seconds * rate))
    target, left = np.zeros((drives, 3)), np.zeros(drives)
    now, out = np.zeros((drives, 3)), np.empty((drives, periods, 3))
    most = np.array((slope, slope, 5 * slope)) / rate
    for k in range(periods):
        due = np.flatnonzero(left <= 0)
        if len(due):
            kind, size = rng.random(len(due)), rng.uniform(0.1, 1.0, (len(due), 2))
            way, side = rng.uniform(-math.pi, math.pi, len(due)), rng.choice((-1.0, 1.0), len(due))
            drawn = np.stack((size[:, 0] * speed * np.cos(way), size[:, 0] * speed * np.sin(way),
                              size[:, 1] * turn * side), axis=1)
            drawn[kind < rests] = 0
            drawn[(kind >= rests) & (kind < rests + 0.15), :2] = 0
            drawn[(kind >= rests + 0.15) & (kind < rests + 0.4), 2] = 0
            target[due], left[due] = drawn, rng.uniform(0.5, 4.0, len(due)) * rate
        left -= 1
        now = now + np.clip(target - now, -most, most)
        out[:, k] = now
    return out


def behind(twists, dead, constant, rate=50.0):
    """What motors make of commands: a dead time and one time constant [s] per drive."""
    drives, periods, _ = twists.shape
    steps = np.broadcast_to(np.asarray(dead) * rate, drives)
    whole = np.floor(steps).astype(int)
    part = (steps - whole)[:, None, None]
    padded = np.concatenate((np.zeros((drives, whole.max() + 1, 3)), twists), axis=1)
    index = np.arange(periods)[None] + whole.max() + 1 - whole[:, None]
    rows = np.arange(drives)[:, None]
    late = (1 - part) * padded[rows, index] + part * padded[rows, index - 1]
    share = 1 - np.exp(-1 / np.maximum(1e-9, np.broadcast_to(constant, drives) * rate))
    out, now = np.empty_like(late), np.zeros((drives, 3))
    for k in range(periods):
        now = now + share[:, None] * (late[:, k] - now)
        out[:, k] = now
    return out


def noise(rng, shape, law="gaussian"):
    """Noise of variance 1, (..., wheels): "gaussian", "common" (80 % of the variance is all wheels'), "student3"."""
    if law == "student3":
        return rng.standard_t(3, shape) / math.sqrt(3)
    own = rng.standard_normal(shape)
    if law == "common":
        return math.sqrt(0.8) * rng.standard_normal(shape[:-1] + (1,)) + math.sqrt(0.2) * own
    return own


def encoders(rng, base, twists, per_root_metre=0.0, law="gaussian", slip=None):
    """Counts (drives, periods, wheels) of a body that moves by `twists`; slip: 1 + how much more each wheel turns."""
    paths = twists @ base.matrix.T / base.rate
    turned = paths + per_root_metre * np.sqrt(np.abs(paths)) * noise(rng, paths.shape, law)
    if slip is not None:
        turned = turned * slip
    start = rng.random((len(paths), 1, base.wheels))
    total = np.floor(np.cumsum(turned, axis=1) / base.edge + start)
    return np.diff(np.concatenate((np.floor(start), total), axis=1), axis=1).astype(int)


def slips(rng, base, twists, share, seconds=4.0, every=20.0):
    """-> (factors for `encoders`, [(drive, first period, wheel)]): one wheel turns `share` faster than it goes.

    Each begins while the robot moves, after a rest of the other wheels' good conduct.
    """
    drives, periods, _ = twists.shape
    factor, began = np.ones((drives, periods, base.wheels)), []
    moving = np.abs(twists @ base.matrix.T).max(axis=2) > 0.1
    for drive in range(drives):
        for start in np.arange(10.0, periods / base.rate - every, every):
            k = int((start + rng.uniform(0, every - 2 * seconds)) * base.rate)
            ahead = np.flatnonzero(moving[drive, k:k + int(seconds * base.rate)])
            if not len(ahead):
                continue
            k, wheel = k + ahead[0], int(rng.integers(base.wheels))
            factor[drive, k:k + int(seconds * base.rate), wheel] = 1 + share
            began.append((drive, k, wheel))
    return factor, began


def true_poses(twists, rate=50.0):
    """Poses (drives, periods, 3) by the exact arcs of each period."""
    drives, periods, _ = twists.shape
    step = twists / rate
    heading = np.cumsum(step[..., 2], axis=1)
    middle = heading - step[..., 2] / 2
    chord = np.sinc(step[..., 2] / 2 / math.pi)
    x = np.cumsum(chord * (np.cos(middle) * step[..., 0] - np.sin(middle) * step[..., 1]), axis=1)
    y = np.cumsum(chord * (np.sin(middle) * step[..., 0] + np.cos(middle) * step[..., 1]), axis=1)
    return np.stack((x, y, heading), axis=2)


#: A gyro's faults: what is not said is as of a healthy one. late: (least, most) [s]; gap: (every, for) [s].
GYRO_FAULTS = {
    "healthy": {}, "sign": {"scale": -1}, "axis x": {"axis": 0}, "axis y": {"axis": 1},
    "degrees": {"scale": 180 / math.pi}, "radians as degrees": {"scale": math.pi / 180},
    "scale 0.8": {"scale": 0.8}, "scale 0.9": {"scale": 0.9}, "scale 0.97": {"scale": 0.97},
    "scale 1.1": {"scale": 1.1}, "scale 1.2": {"scale": 1.2}, "saturated at 60 deg/s": {"range": math.radians(60)},
    "tilt 5 degrees": {"scale": math.cos(math.radians(5))}, "late 100 ms": {"late": (0.1, 0.1)},
    "late 300 ms": {"late": (0.3, 0.3)}, "late 0 to 300 ms": {"late": (0.0, 0.3)},
    "stamps 60 ms late": {"stamp": 0.06}, "gaps": {"gap": (7.0, 1.5)}, "clock 100 ppm": {"drift": 1e-4},
    "another machine's clock": {"stamp": -5.0}, "a clock ahead": {"stamp": 3.0}, "9 Hz": {"rate": 9.0},
    "zeros": {"zero": True}, "not a number": {"nan": True},
}


def gyro(rng, heading, rate=50.0, fault=None, sigma=0.003, bias=0.01, every=200.0):
    """-> (arrival (m,), stamp (m,), rates about x, y, z (m, 3)) of a gyro on a body of that heading (periods,).

    sigma is the noise of one sample [rad/s] at 200 Hz, bias at most so much [rad/s].
    """
    fault = dict(fault or {})
    every = fault.get("rate", every)
    end = len(heading) / rate
    taken = np.arange(1, int(end * every)) / every + rng.uniform(0, 1 / every)
    taken = taken[taken < end]
    known = np.concatenate(((0.0,), heading))
    angle = np.interp(np.concatenate((taken[:1] - 1 / every, taken)), np.arange(len(known)) / rate, known)
    true = np.diff(angle) * every
    rates = rng.normal(0, sigma, (len(taken), 3))
    rates[:, 0] += rng.uniform(-bias, bias)
    axis = fault.get("axis", 2)
    rates[:, 2] += rng.uniform(-bias, bias)
    if axis == 2:
        rates[:, 2] += fault.get("scale", 1.0) * true
    limit = fault.get("range", math.radians(2000))
    rates = np.clip(rates, -limit, limit)
    rates = np.round(rates / 1e-4) * 1e-4
    rates *= 0 if fault.get("zero") else 1
    if fault.get("nan"):
        rates[rng.random(len(rates)) < 0.3] = math.nan
    low, high = fault.get("late", (0.002, 0.006))
    arrival = np.maximum.accumulate(taken + rng.uniform(low, high, len(taken)))
    stamp = taken * (1 + fault.get("drift", 0.0)) + fault.get("stamp", 0.0)
    if "gap" in fault:
        often, length = fault["gap"]
        kept = (taken % often) > length
        arrival, stamp, rates = arrival[kept], stamp[kept], rates[kept]
    return arrival, stamp, rates


#: Patterns of a port: see `arrivals`.
PORTS = {
    "usb": {}, "fast clock": {"drift": 0.02}, "slow clock": {"drift": -0.02}, "a clock that warms up": {"warm": 2e-4},
    "jitter": {"jitter": 0.001}, "poll 1 ms": {"poll": 0.001}, "ftdi 16 ms": {"poll": 0.016},
    "ftdi 16 ms, drift": {"poll": 0.016, "drift": 3e-3}, "loss 5 %": {"loss": 0.05},
    "loss 5 %, ftdi": {"loss": 0.05, "poll": 0.016}, "stalls 0.2 s": {"stall": (0.2,)},
    "stalls 0.2 to 2.5 s": {"stall": (0.2, 0.5, 1.0, 1.5, 2.5)}, "stalls, loss": {"stall": (0.2, 1.5), "loss": 0.02},
    "stalls that lose": {"stall": (0.5, 2.5), "kept": 20}, "bursts lost": {"burst": (25, 15.0)},
    "restarts": {"restart": 120.0},
}


def arrivals(rng, pattern, seconds=1200.0, rate=50.0, floor=0.004):
    """-> (number, made, arrived, stalls): packets that came, one of each; stalls [(from, to)] of the reader.

    A packet takes `floor` at least, and some tenths of a millisecond. poll: handed on at its multiples only. kept: what
    a reader that stands still finds again of the newest. burst: so many lost in a row, each so many seconds.
    """
    count = int(seconds * rate)
    k = np.arange(count)
    period = (1 + pattern.get("drift", 0.0)) / rate
    made = k * period + pattern.get("warm", 0.0) * seconds / 8 * (1 - np.exp(-k * period / (seconds / 4)))
    number = k.copy()
    if "restart" in pattern:
        each = int(pattern["restart"] * rate)
        number, made = k % each, made + (k // each) * 1.3371
    arrived = made + floor + rng.exponential(0.0001, count)
    if "jitter" in pattern:
        arrived = arrived + rng.exponential(pattern["jitter"], count)
    if "poll" in pattern:
        phase = rng.uniform(0, pattern["poll"])
        arrived = np.ceil((arrived - phase) / pattern["poll"]) * pattern["poll"] + phase
    came, stalls = rng.random(count) >= pattern.get("loss", 0.0), []
    if "burst" in pattern:
        length, often = pattern["burst"]
        came &= (k % int(often * rate)) >= length
    if "stall" in pattern:
        at = 30.0
        while at < made[-1] - 40:
            length = float(rng.choice(pattern["stall"]))
            held = (arrived >= at) & (arrived < at + length)
            if "kept" in pattern:
                came[np.flatnonzero(held)[:-pattern["kept"]]] = False
            arrived[held] = at + length + np.arange(held.sum()) * 1e-4
            stalls.append((at, at + length))
            at += length + rng.uniform(15, 35)
    arrived = np.maximum.accumulate(arrived)
    return number[came], made[came], arrived[came], stalls
