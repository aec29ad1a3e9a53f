"""Airspeed from messages: selection of the message, and true from equivalent airspeed."""

from math import isfinite, sqrt
from typing import Final

from estimators.attitude.parameters import AirspeedSource
from flightsim.foundation.atmosphere import SEA_LEVEL_DENSITY_KG_M3, SEA_LEVEL_PRESSURE_PA

_DENSITY_EXPONENT: Final = 1.0 - 1.0 / 5.25588
"""Density by pressure in the standard atmosphere, rounded: stored estimates are compared to the bit."""
_HECTOPASCAL_MAX: Final = 1200.0
_LEAST_PA: Final = 20_000.0
_AIRSPEED_MAX_M_S: Final = 400.0
_HPA: Final = 100.0


def pressure_unit_pa(static: float) -> float:
    """Pascals in the unit of a message's pressures, by its static pressure: PX4 1.16 fills those of
    HIGHRES_IMU in pascal, later ones and other autopilots in hectopascal, as MAVLink has them.
    """
    return 1.0 if static > _HECTOPASCAL_MAX else _HPA


def pressure_pa(value: float) -> float | None:
    """Static pressure from a field of that unit. None: no pressure."""
    pascal = value * pressure_unit_pa(value)
    return pascal if _LEAST_PA <= pascal <= 1.2 * SEA_LEVEL_PRESSURE_PA else None


def true_over_equivalent(static_pa: float) -> float:
    """Ratio of true to equivalent airspeed in the standard atmosphere."""
    return float((static_pa / SEA_LEVEL_PRESSURE_PA) ** (-0.5 * _DENSITY_EXPONENT))


class AirData:
    """Selects the airspeed among the messages that contain one.

    Args:
        source: the source to use; AUTO: the first, in the order of `AirspeedSource`, that was received
            recently.
        age_max_us: longest age that counts as recent.
    """

    def __init__(self, source: AirspeedSource, age_max_us: int) -> None:
        self._source = source
        self._age_max_us = age_max_us
        self._received_us: dict[AirspeedSource, int] = {}
        self._ratio = 1.0

    @property
    def ratio(self) -> float:
        """Present ratio of true to equivalent airspeed."""
        return self._ratio

    def static_pressure(self, value: float) -> None:
        """Take a static pressure in hectopascal."""
        pascal = pressure_pa(value)
        if pascal is not None:
            self._ratio = true_over_equivalent(pascal)

    def airspeed(self, time_us: int, source: AirspeedSource, equivalent_m_s: float) -> float | None:
        """True airspeed, m/s; None when another source is used, or the value is invalid."""
        if not (isfinite(equivalent_m_s) and 0.0 < equivalent_m_s <= _AIRSPEED_MAX_M_S):
            return None
        self._received_us[source] = time_us
        if source is not self._source and not (
            self._source is AirspeedSource.AUTO and self._best(time_us, source)
        ):
            return None
        return equivalent_m_s * self._ratio

    def by_pressure(self, time_us: int, static: float, difference: float) -> float | None:
        """True airspeed, m/s, from the static and the differential pressure of a message, in the unit of
        `pressure_unit_pa`; None as in `airspeed`.
        """
        if not (isfinite(difference) and difference > 0.0):
            return None
        equivalent = sqrt(2.0 * difference * pressure_unit_pa(static) / SEA_LEVEL_DENSITY_KG_M3)
        return self.airspeed(time_us, AirspeedSource.PRESSURE, equivalent)

    def _best(self, time_us: int, source: AirspeedSource) -> bool:
        for better in (AirspeedSource.VFR_HUD, AirspeedSource.AIRSPEED):
            if better is source:
                return True
            received_us = self._received_us.get(better)
            if received_us is not None and time_us - received_us <= self._age_max_us:
                return False
        return True

    def reset(self) -> None:
        """Forget everything."""
        self._received_us.clear()
        self._ratio = 1.0
