"""Robots of any encoder, rate and gear, drawn by their seeds, and those at the corners."""

import itertools
import random
from typing import NamedTuple

SPEEDS, ZEROS, SILENCE = (0.3, 1.0), (1.0, 2.0), (1.5, 2.0)  # [m/s] at which a stop may take so long [s]


class Case(NamedTuple):
    """A robot as its folder tells it, and how many times as much its encoders count; speed [m/s], and how it stops."""

    edges: int
    rate: int
    gear: float
    times: float
    speed: float
    angle: int
    zeros: bool


def draw(seed):
    """A `Case`; every second with encoders that are as told."""
    rng = random.Random(seed)

    def between(least, most):
        return least * (most / least) ** rng.random()
    return Case(round(between(12, 4096)), round(between(10, 200)), round(between(5, 100), 1),
                round(between(0.5, 16), 2) if seed % 2 else 1, rng.choice((0.3, 1.0)), rng.randrange(0, 360, 15),
                rng.random() < 0.5)


CORNERS = [
    Case(edges, rate, gear, times, 1.0, number * 45 % 360, zeros)
    for number, (gear, rate, edges, times, zeros) in enumerate(itertools.product(
        (5, 20, 100), (10, 24, 50, 200), (12, 64, 512, 4096), (0.5, 1, 2, 4, 16), (True, False)))]
