"""How full a battery is, from its voltage: the pack in a robot's driver.yaml."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robotont_driver.parameters.parameters import ParameterError, fault

LOW, EMPTY = 0.15, 0.05  # charge at which it is to be charged; at which the fleet gives a robot no new goals
REST = 30.0              # [s] of which the highest voltage counts: motors pull it down only while they work
ABSENT = 0.6             # of the lowest voltage, below which no battery is connected to what measures


class Pack(NamedTuple):
    """`battery` of a driver.yaml."""

    curve: Tuple[Tuple[float, float], ...]  # (voltage at rest [V], charge 0..1), both rising
    resistance: float                       # [ohm] of pack and leads


def read_pack(given):
    """The Pack of `battery: {curve, resistance}`; None for none. Raises ParameterError."""
    if given is None:
        return None
    try:
        curve = tuple((float(voltage), float(charge)) for voltage, charge in given["curve"])
        pack = Pack(curve, float(given["resistance"]))
        numbers = [0.0, *(voltage for voltage, _ in curve)], [-1e-9, *(charge for _, charge in curve), 1.0 + 1e-9]
        rising = all(low < high < math.inf for one in numbers for low, high in zip(one, one[1:]))
        if set(given) == {"curve", "resistance"} and len(curve) > 1 and rising and 0.0 <= pack.resistance <= 1.0:
            return pack
    except (TypeError, ValueError, KeyError, AttributeError):
        pass
    raise ParameterError([fault("battery", given, "curve, pairs of a voltage [V] and the charge (0 to 1) there, both "
                                "rising, and resistance, 0 to 1 [ohm]")])


class Battery:
    """The charge of a pack, from what is measured under load."""

    def __init__(self, pack):
        self._pack = pack
        self._rested = []  # (voltage [V] that it would have at rest, time [s]) of late
        self.charge = math.nan  # 0..1; NaN: not measured

    def hear(self, voltage, current, now):
        """Measured at time `now` [s]: voltage [V], current drawn [A], NaN where that is not measured."""
        if self._pack is None or not voltage > ABSENT * self._pack.curve[0][0]:
            self._rested, self.charge = [], math.nan
            return
        rest = voltage + (current * self._pack.resistance if math.isfinite(current) else 0.0)
        self._rested = [(rest, now), *(one for one in self._rested if now - one[1] <= REST)]
        self.charge = float(np.interp(max(self._rested)[0], *zip(*self._pack.curve)))

    @property
    def complaint(self):
        """(whether it is empty, words); words are "" for a battery that is well or not measured."""
        if not self.charge <= LOW:
            return False, ""
        empty = self.charge <= EMPTY
        return empty, f"the battery is {'empty' if empty else 'low'}, {100 * self.charge:.0f} %: charge it"
