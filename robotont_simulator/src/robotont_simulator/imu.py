"""A simulated inertial measurement unit with the errors of a Bosch BMI055, as in Intel's D435i.

Data sheet: gyro noise 0.014 deg/s/sqrt(Hz), zero-rate offset of 1 deg/s; accelerometer noise 150 ug/sqrt(Hz), zero-g
offset 70 mg, of which a calibrated one keeps little. The walk of the biases and the error of the gyro's scale
(1 % from the factory) are those that a gyro has after a calibration at about constant temperature.
"""

import math

import numpy as np

GRAVITY = 9.81                              # [m/s^2]
GYRO_NOISE = math.radians(0.014)            # [rad/s/sqrt(Hz)]
GYRO_BIAS = math.radians(0.5)               # [rad/s] standard deviation of the offset at the start
GYRO_DRIFT = 1e-5                           # [rad/s/sqrt(s)] walk of the offset
GYRO_SCALE = 3e-4                           # standard deviation of the scale's error
ACCELEROMETER_NOISE = 150e-6 * GRAVITY      # [m/s^2/sqrt(Hz)]
ACCELEROMETER_BIAS = 5e-3 * GRAVITY         # [m/s^2]
ACCELEROMETER_DRIFT = 1e-4                  # [m/s^2/sqrt(s)]


class ImuErrors:
    """Spoils true rates and accelerations at `rate` [Hz]; deterministic for a generator and a sequence of calls."""

    def __init__(self, rate, generator):
        self._random = generator
        self._interval = 1.0 / rate
        self.gyro_scale = 1.0 + GYRO_SCALE * generator.standard_normal()
        self.gyro_bias = GYRO_BIAS * generator.standard_normal(3)                    # [rad/s]
        self.accelerometer_bias = ACCELEROMETER_BIAS * generator.standard_normal(3)  # [m/s^2]
        # [rad/s], [m/s^2] standard deviation of a single reading
        self.gyro_deviation, self.accelerometer_deviation = (
            density * math.sqrt(rate) for density in (GYRO_NOISE, ACCELEROMETER_NOISE))

    def measure(self, rates, accelerations):
        """(angular velocity [rad/s], 3; acceleration [m/s^2], 3) that the device reports for the true ones."""
        draw = self._random.standard_normal((4, 3))
        walk = math.sqrt(self._interval)
        self.gyro_bias = self.gyro_bias + GYRO_DRIFT * walk * draw[0]
        self.accelerometer_bias = self.accelerometer_bias + ACCELEROMETER_DRIFT * walk * draw[1]
        return (self.gyro_scale * np.asarray(rates) + self.gyro_bias + self.gyro_deviation * draw[2],
                np.asarray(accelerations) + self.accelerometer_bias + self.accelerometer_deviation * draw[3])
