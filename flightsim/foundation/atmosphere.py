"""Standard gravity and the standard atmosphere (ISO 2533), troposphere."""

import math
from typing import Final

GRAVITY_M_S2: Final = 9.80665

_SEA_LEVEL_K: Final = 288.15
_SEA_LEVEL_PA: Final = 101_325.0
_LAPSE_K_M: Final = 0.0065
_EXPONENT: Final = GRAVITY_M_S2 / (287.05287 * _LAPSE_K_M)
_TROPOPAUSE_M: Final = 11_000.0


def pressure_altitude_m(static_pa: float) -> float:
    """Altitude, m, in the standard atmosphere at which the pressure has this value."""
    return _SEA_LEVEL_K / _LAPSE_K_M * (1.0 - (static_pa / _SEA_LEVEL_PA) ** (1.0 / _EXPONENT))


def air_density_ratio(static_pa: float) -> float:
    """Ratio of the standard atmosphere's density at this pressure to that at sea level."""
    return float((static_pa / _SEA_LEVEL_PA) ** (1.0 - 1.0 / _EXPONENT))


def true_over_equivalent_airspeed(altitude_m: float) -> float:
    """Ratio of true to equivalent airspeed at an altitude above mean sea level on a standard day: 1.03 at 600
    m.

    Above the tropopause the value at the tropopause is returned.
    """
    temperature = 1.0 - _LAPSE_K_M * min(altitude_m, _TROPOPAUSE_M) / _SEA_LEVEL_K
    return math.exp(-0.5 * (_EXPONENT - 1.0) * math.log(temperature))
