"""The field's variation in time: the quiet daily variation, and pulsations.

On quiet days the total field of middle latitudes dips around local noon by some tens of nT (Sq; Campbell
1989, "The regular geomagnetic field variations during quiet solar conditions", Geomagnetism 3). Faster
pulsations of minutes have some tenths of a nT to some nT. Both are the same over a survey's area, so two
lines that were flown at different times differ by them, and levelling takes them out.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative
from flightsim.foundation.options import Options

Array = NDArray[np.float64]

_DAY_S: Final = 86_400.0
_DIP_S: Final = 3.0 * 3600.0  # standard deviation of the dip around noon
_PULSATIONS: Final = 8
_PERIODS_S: Final = (60.0, 900.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class DailyVariationParameters(Options):
    """Sizes of the variation.

    Attributes:
        dip_nt: depth of the dip at local noon.
        boot_h: local solar time at boot, hours.
        pulsation_nt: standard deviation of the pulsations of 1 to 15 minutes.
    """

    dip_nt: float = 30.0
    boot_h: float = 9.0
    pulsation_nt: NotNegative = 0.5

    def check_together(self) -> None:
        if not 0.0 <= self.boot_h < 24.0:
            raise ValueError(f"boot_h = {self.boot_h} is not accepted: 0 to less than 24 hours are")


class DailyVariation:
    """One day's variation, a function of time.

    Args:
        parameters: its sizes.
        seed: of the pulsations.
    """

    def __init__(self, parameters: DailyVariationParameters, seed: np.random.SeedSequence) -> None:
        rng = np.random.Generator(np.random.PCG64(seed))
        self._parameters = parameters
        low, high = (math.log(period_s) for period_s in _PERIODS_S)
        self._rates_rad_s: Array = math.tau / np.exp(rng.uniform(low, high, _PULSATIONS))
        self._phases: Array = rng.uniform(0.0, math.tau, _PULSATIONS)

    def at_nt(self, time_s: float) -> float:
        """What it adds to the total field at a time since boot."""
        p = self._parameters
        from_noon_s = math.remainder(3600.0 * p.boot_h + time_s - 0.5 * _DAY_S, _DAY_S)
        dip = -p.dip_nt * math.exp(-0.5 * (from_noon_s / _DIP_S) ** 2)
        waves = np.sin(self._rates_rad_s * time_s + self._phases)
        return dip + p.pulsation_nt * math.sqrt(2.0 / _PULSATIONS) * float(waves.sum())
