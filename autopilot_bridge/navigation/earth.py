"""The filter's model of the Earth: gravity, rotation, pressure altitude and density."""

import math
from typing import Final

EARTH_RATE_RAD_S: Final = 7.292115e-5  # WGS84, NGA.STND.0036, table 3.1
STANDARD_GRAVITY_M_S2: Final = 9.80665
_ISA_PRESSURE_PA: Final = 101325.0
_ISA_TEMPERATURE_K: Final = 288.15
_ISA_LAPSE_K_M: Final = 0.0065
_GAS_CONSTANT_J_KG_K: Final = 287.05287
_ISA_EXPONENT: Final = _GAS_CONSTANT_J_KG_K * _ISA_LAPSE_K_M / STANDARD_GRAVITY_M_S2
SEA_LEVEL_DENSITY_KG_M3: Final = _ISA_PRESSURE_PA / (_GAS_CONSTANT_J_KG_K * _ISA_TEMPERATURE_K)


def normal_gravity_m_s2(lat_deg: float, alt_m: float) -> float:
    """Gravity on and above the WGS84 ellipsoid, m/s^2 (NGA.STND.0036, equations 4-1 and 4-3 to second
    order)."""
    sin2 = math.sin(math.radians(lat_deg)) ** 2
    surface = 9.7803253359 * (1.0 + 0.00193185265241 * sin2) / math.sqrt(1.0 - 0.00669437999013 * sin2)
    h = alt_m / 6378137.0
    return surface * (
        1.0
        - 2.0 * (1.0 + 0.00335281066475 + 0.00344978650684 - 2.0 * 0.00335281066475 * sin2) * h
        + 3.0 * h * h
    )


def earth_rate_ned_rad_s(lat_deg: float) -> tuple[float, float, float]:
    """Rotation of the Earth against inertial space in NED, rad/s."""
    lat = math.radians(lat_deg)
    return EARTH_RATE_RAD_S * math.cos(lat), 0.0, -EARTH_RATE_RAD_S * math.sin(lat)


def pressure_altitude_m(pressure_pa: float) -> float:
    """Height in the standard atmosphere's troposphere (ISO 2533); NaN for pressures that aren't positive."""
    if not 0.0 < pressure_pa < 2.0e5:
        return math.nan
    return _ISA_TEMPERATURE_K / _ISA_LAPSE_K_M * (1.0 - (pressure_pa / _ISA_PRESSURE_PA) ** _ISA_EXPONENT)


def standard_temperature_k(pressure_pa: float) -> float:
    """Temperature where the standard atmosphere's troposphere has this pressure (ISO 2533)."""
    return _ISA_TEMPERATURE_K * (pressure_pa / _ISA_PRESSURE_PA) ** _ISA_EXPONENT


def air_density_kg_m3(pressure_pa: float, temperature_k: float) -> float:
    """Density of dry air (ISO 2533, equation of state)."""
    return pressure_pa / (_GAS_CONSTANT_J_KG_K * temperature_k)
