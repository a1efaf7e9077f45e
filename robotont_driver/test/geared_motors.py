"""Lifted wheels behind geared motors in floating point, from the parts' constants; shares nothing with the fit.

Two masses: a rotor with inductance, cogging and its own friction; a wheel behind a gear with play and elastic teeth.
The encoder sits on the rotor's shaft, its edges at uneven distances. 0.1 ms a step; many wheels at once.
"""

import numpy as np

PERIOD, STEP, LATE = 0.02, 1e-4, 0.003  # [s] control period, of the integration, from the tick to the new effort
EDGES, FULL = 64, 4000                  # per turn of the rotor; effort of the whole battery


class GearedMotors:
    """Sizes are those of a Pololu 37D with a wheel of 35 mm unless told; numbers, or (n, 1) of n wheels."""

    def __init__(self, volts=12.0, back_emf=0.01222, ohms=2.4, henry=1.6e-3, rotor=1.25e-6, wheel=6e-5, gear=18.75,
                 friction=0.0012, wheel_friction=0.003, viscous=0.0, cogging=0.0006, play=0.02, uneven=0.2):
        self.volts, self.k, self.ohms, self.henry, self.rotor, self.wheel, self.gear = (
            volts, back_emf, ohms, henry, rotor, wheel, gear)
        self.friction, self.wheel_friction, self.viscous, self.cogging, self.play = (
            friction, wheel_friction, viscous, cogging, play)
        self.uneven = uneven

    @property
    def truth(self):
        """(friction [effort], gain [effort per edge/period], tau [periods]) of rigid gears."""
        torque = self.k * self.volts / self.ohms / FULL  # per effort
        drag = self.k ** 2 / self.ohms + self.viscous
        edge = 2 * np.pi / EDGES / PERIOD                # [rad/s] per edge/period
        inertia = self.rotor + self.wheel / self.gear ** 2
        return (self.friction + self.wheel_friction / self.gear) / torque, drag * edge / torque, inertia / drag / PERIOD

    def steps(self, efforts, periods=25, seed=0):
        """Counts (..., n, periods) of steps (..., n) from rest, each from another place of the rotor."""
        random = np.random.default_rng(seed)
        efforts = np.asarray(efforts, float)
        zero = np.zeros(np.broadcast(efforts, *vars(self).values()).shape)
        angle = random.uniform(0, 2 * np.pi, zero.shape)
        far = (angle + random.uniform(-1, 1, zero.shape) * self.play) / self.gear
        phases = random.uniform(0, 2 * np.pi, 3)
        speed, far_speed, current, edges = zero.copy(), zero.copy(), zero.copy(), [self._edges(angle, phases)]
        stiff, damping = 2.0, 6e-5  # of the teeth, at the rotor
        for step in range(round(periods * PERIOD / STEP)):
            volts = efforts * (self.volts / FULL) * (step * STEP >= LATE)
            current += STEP / self.henry * (volts - self.ohms * current - self.k * speed)
            gap = angle - far * self.gear
            teeth = np.where(np.abs(gap) > self.play, stiff * (gap - np.sign(gap) * self.play)
                             + damping * (speed - far_speed * self.gear), 0.0)
            speed = _rub(speed, self.k * current - teeth - self.viscous * speed - self.cogging * np.sin(12 * angle),
                         self.friction, self.rotor)
            far_speed = _rub(far_speed, teeth * self.gear, self.wheel_friction, self.wheel)
            angle, far = angle + STEP * speed, far + STEP * far_speed
            if (step + 1) % round(PERIOD / STEP) == 0:
                edges.append(self._edges(angle, phases))
        return np.moveaxis(np.diff(edges, axis=0), 0, -1)

    def _edges(self, angle, phases):
        """Edges passed; the pole pitches are uneven by up to self.uneven of an edge."""
        turns = angle * EDGES / (2 * np.pi)
        waves = sum(np.sin((order + 1) * angle + phase) for order, phase in enumerate(phases))
        return np.floor(turns + self.uneven / 3 * waves)


def _rub(speed, torque, friction, inertia):
    """The speed a STEP later under Coulomb friction."""
    free = speed + STEP * torque / inertia
    loss = STEP * friction / inertia
    return np.where(np.abs(free) <= loss, 0.0, free - np.sign(free) * loss)
