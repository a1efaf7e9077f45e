"""A simulated inertial measurement unit with the errors of a Bosch BMI055, as in Intel's D435i.

Data sheet: gyro noise 0.014 deg/s/sqrt(Hz), zero-rate offset of 1 deg/s; accelerometer noise 150 ug/sqrt(Hz), zero-g
offset 70 mg, of which a calibrated one keeps little. The walk of the biases and the error of the gyro's scale
(1 % from the factory) are those that a gyro has after a calibration at about constant temperature.
"""

import math

import numpy as np

GRAVITY = 9.81  # [m/s^2]
# Of the three axes of the gyro [rad/s] and of the accelerometer [m/s^2]: noise per sqrt(Hz), standard deviations of the
# offset at the start and of the scale's error, walk of the offset per sqrt(s)
NOISE, BIAS, SCALE, DRIFT = np.repeat([
    (math.radians(0.014), 150e-6 * GRAVITY), (math.radians(0.5), 5e-3 * GRAVITY), (3e-4, 0.0), (1e-5, 1e-4)], 3, axis=1)


class ImuErrors:
    """Spoils true readings at `rate` [Hz]; deterministic for a generator and a sequence of calls."""

    def __init__(self, rate, generator):
        self._random, self._walk = generator, DRIFT / math.sqrt(rate)
        self.scale, self.bias = 1.0 + SCALE * generator.standard_normal(6), BIAS * generator.standard_normal(6)
        self.deviation = NOISE * math.sqrt(rate)  # of a single reading

    def measure(self, readings):
        """What the device reports for true ones: angular velocity [rad/s], acceleration [m/s^2], 6 numbers."""
        walk, noise = self._random.standard_normal((2, 6))
        self.bias = self.bias + self._walk * walk
        return self.scale * readings + self.bias + self.deviation * noise
