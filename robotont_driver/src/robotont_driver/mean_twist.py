"""The twist over the newest packets: calmer than that of one packet, in which one edge is 9 mm/s."""

from collections import deque

from robotont_driver.covariance import Covariance
from robotont_driver.wheel_noise import PATH_VARIANCE

CHANGING = 3.0  # [standard deviations] from which on the halves of the window show that the robot changes its speed


class MeanTwist:
    """Mean twist of the newest steps, with its covariance as an estimate of the twist at their end.

    period: [s] of one step. packets: how many steps, 1 or more.
    """

    def __init__(self, period, packets=1):
        self._period = period
        self._steps = deque(maxlen=packets)  # (step, covariance)

    def add(self, step, covariance, edge_covariance):
        """(twist (3), Covariance) once this step is the newest.

        step: (dx [m], dy [m], dyaw [rad]); covariance: of it by what is new in every packet; edge_covariance: of a
        step, for 1 edge^2 in every wheel. The errors of readings cancel within the window, but for its ends. Where
        the speed changes, the mean lags behind by half the window, which the covariance covers.
        """
        steps = self._steps
        steps.append((step, covariance))
        if len(steps) == 1:
            return self._twist(step, covariance, edge_covariance, self._period)
        time = len(steps) * self._period
        total = Covariance(*_sum(covariance for _, covariance in steps))
        lag = self._lag(total, edge_covariance)
        twist, spread = self._twist(_sum(step for step, _ in steps), total, edge_covariance, time)
        return twist, spread.plus(Covariance.of_vector(lag))

    @staticmethod
    def _twist(path, covariance, edge_covariance, time):
        """(twist (3), Covariance) of a path (3) that took a time [s]; covariance: without the readings at its ends."""
        factor = 1 / time ** 2
        return [length / time for length in path], Covariance(*[
            (own + PATH_VARIANCE * edge) * factor for own, edge in zip(covariance, edge_covariance)])

    def _lag(self, total, edge_covariance):
        """(3,) by how much the mean lags behind; 0 where noise explains the difference of the halves of the window."""
        half = len(self._steps) // 2
        time = half * self._period
        steps = [step for step, _ in self._steps]
        differences = [(newer - older) / time for newer, older in zip(_sum(steps[-half:]), _sum(steps[:half]))]
        # three readings: at the ends, and twice, with the other sign, in the middle
        noise = total.plus(edge_covariance.times(3 * PATH_VARIANCE)).times(1 / time ** 2)
        return [difference if difference ** 2 > CHANGING ** 2 * variance else 0.0
                for difference, variance in zip(differences, (noise.xx, noise.yy, noise.aa))]


def _sum(steps):
    """Component by component."""
    return [sum(lengths) for lengths in zip(*steps)]
