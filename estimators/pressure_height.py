"""Height from static pressure, for flight without GPS."""

import math
from typing import Final

from flightsim.foundation.atmosphere import pressure_altitude_m

_FILTER_S: Final = 0.3


class PressureHeight:
    """Height over the place of the ground pressure, from pressure and climb rate.

    It is the difference of two pressure altitudes; on a day that is 10 K warmer than the standard atmosphere
    it is 3.5 % too small. The climb rate is used between the samples, and to reduce their noise.

    Args:
        ground_pa: pressure on the ground.
    """

    def __init__(self, ground_pa: float) -> None:
        if not 10_000.0 < ground_pa < 120_000.0:
            raise ValueError(f"a ground pressure of {ground_pa:g} Pa is not on this Earth: 10000..120000 Pa")
        self.ground_pa = ground_pa
        self._ground_m = pressure_altitude_m(ground_pa)
        self._height_m = math.nan
        self._time_us = 0

    @property
    def height_m(self) -> float:
        """Height, m; NaN before the first sample."""
        return self._height_m

    def add(self, time_us: int, static_pa: float, climb_m_s: float) -> float:
        """Add a sample; returns the height."""
        if not 10_000.0 < static_pa < 120_000.0:
            return self._height_m
        measured = pressure_altitude_m(static_pa) - self._ground_m
        dt = (time_us - self._time_us) * 1e-6
        if math.isnan(self._height_m) or not 0.0 < dt < 5.0:
            self._height_m = measured
        else:
            ahead = self._height_m + climb_m_s * dt
            self._height_m = ahead + dt / (_FILTER_S + dt) * (measured - ahead)
        self._time_us = time_us
        return self._height_m
