"""The twist over the newest packets: calmer than that of one packet, in which one edge is 9 mm/s."""

from collections import deque

import numpy as np

from robotont_driver.wheel_noise import PATH_VARIANCE

CHANGING = 3.0  # [standard deviations] from which on the halves of the window show that the robot changes its speed


class MeanTwist:
    """Mean twist of the newest steps, with its covariance as an estimate of the twist at their end.

    period: [s] of one step. packets: how many steps.
    """

    def __init__(self, period, packets):
        self._period = period
        self._steps = deque(maxlen=packets)
        self._sum = np.zeros(3)
        self._covariance = np.zeros((3, 3))

    def add(self, step, covariance, edge_covariance):
        """(twist (3), covariance (3 x 3)) once this step is the newest.

        step: (dx [m], dy [m], dyaw [rad]); covariance: of it by what is new in every packet; edge_covariance: of a
        step, for 1 edge^2 in every wheel. The errors of readings cancel within the window, but for its ends. Where
        the speed changes, the mean lags behind by half the window, which the covariance covers.
        """
        steps = self._steps
        if len(steps) == steps.maxlen:
            self._sum = self._sum - steps[0][0]
            self._covariance = self._covariance - steps[0][1]
        steps.append((step, covariance))
        self._sum = self._sum + step
        self._covariance = self._covariance + covariance
        time = len(steps) * self._period
        total = self._covariance + PATH_VARIANCE * edge_covariance
        lag = self._lag(edge_covariance)
        return self._sum / time, total / time ** 2 + np.outer(lag, lag)

    def _lag(self, edge_covariance):
        """(3,) by how much the mean lags behind; 0 where noise explains the difference of the halves of the window."""
        half = len(self._steps) // 2
        if not half:
            return np.zeros(3)
        time = half * self._period
        newer = sum(step for step, _ in list(self._steps)[-half:])
        older = sum(step for step, _ in list(self._steps)[:half])
        difference = (newer - older) / time
        # three readings: at the ends, and twice, with the other sign, in the middle
        variance = (self._covariance.diagonal() + 3 * PATH_VARIANCE * edge_covariance.diagonal()) / time ** 2
        return np.where(difference ** 2 > CHANGING ** 2 * variance, difference, 0.0)
