"""Three geared motors with encoders, simple enough that their exact positions are known."""

import math

EDGES_PER_METRE = 64 * 18.75 / (2 * math.pi * 0.035)


class Motors:
    """Each motor follows its effort with one time constant; its encoder counts whole edges, counterclockwise positive.

    top_speed: [m/s] of the rim at full effort. `paths`: [m] that each rim has really gone.
    """

    def __init__(self, amount=3, top_speed=1.83, time_constant=0.05):
        self.paths = [0.0] * amount
        self.speeds = [0.0] * amount  # [m/s]
        self._top_speed = top_speed
        self._time_constant = time_constant
        self._counted = [0] * amount

    def turn(self, efforts, seconds):
        """Let time pass with efforts from -1 to 1; the edges, integers, that the encoders have counted in it."""
        kept = math.exp(-seconds / self._time_constant)
        counts = []
        for motor, effort in enumerate(efforts):
            aim, speed = effort * self._top_speed, self.speeds[motor]
            self.paths[motor] += aim * seconds + (speed - aim) * self._time_constant * (1 - kept)
            self.speeds[motor] = aim + (speed - aim) * kept
            edges = math.floor(self.paths[motor] * EDGES_PER_METRE)
            counts.append(edges - self._counted[motor])
            self._counted[motor] = edges
        return counts
