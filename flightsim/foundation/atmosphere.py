"""Standard gravity and the troposphere of the standard atmosphere (ISO 2533)."""

import math
from typing import Final

GRAVITY_M_S2: Final = 9.80665
ICE_POINT_K: Final = 273.15
"""0 deg C."""
SEA_LEVEL_TEMPERATURE_K: Final = 288.15
SEA_LEVEL_PRESSURE_PA: Final = 101_325.0
SEA_LEVEL_DENSITY_KG_M3: Final = 1.225
"""As the standard rounds it; `air_density_kg_m3` at sea level is larger by a part in 10^8."""
GAS_CONSTANT_J_KG_K: Final = 287.05287
"""Of dry air."""

_LAPSE_K_M: Final = 0.0065
_EXPONENT: Final = GRAVITY_M_S2 / (GAS_CONSTANT_J_KG_K * _LAPSE_K_M)
_TROPOPAUSE_M: Final = 11_000.0
_PRESSURE_MAX_PA: Final = 2.0e5


def pressure_altitude_m(static_pa: float) -> float:
    """Altitude, m, in the standard atmosphere at which the pressure has this value; NaN for values that are
    no pressure of the atmosphere."""
    if not 0.0 < static_pa < _PRESSURE_MAX_PA:
        return math.nan
    return SEA_LEVEL_TEMPERATURE_K / _LAPSE_K_M * (1.0 - _pressure_ratio(static_pa) ** (1.0 / _EXPONENT))


def standard_temperature_k(static_pa: float) -> float:
    """Temperature where the standard atmosphere has this pressure."""
    return float(SEA_LEVEL_TEMPERATURE_K * _pressure_ratio(static_pa) ** (1.0 / _EXPONENT))


def air_density_kg_m3(static_pa: float, temperature_k: float) -> float:
    """Density of dry air (equation of state)."""
    return static_pa / (GAS_CONSTANT_J_KG_K * temperature_k)


def air_density_ratio(static_pa: float) -> float:
    """Ratio of the standard atmosphere's density at this pressure to that at sea level."""
    return float(_pressure_ratio(static_pa) ** (1.0 - 1.0 / _EXPONENT))


def true_over_equivalent_airspeed(altitude_m: float) -> float:
    """Ratio of true to equivalent airspeed at an altitude above mean sea level on a standard day: 1.03 at 600
    m.

    Above the tropopause the value at the tropopause is returned.
    """
    temperature = 1.0 - _LAPSE_K_M * min(altitude_m, _TROPOPAUSE_M) / SEA_LEVEL_TEMPERATURE_K
    return math.exp(-0.5 * (_EXPONENT - 1.0) * math.log(temperature))


def _pressure_ratio(static_pa: float) -> float:
    return static_pa / SEA_LEVEL_PRESSURE_PA
