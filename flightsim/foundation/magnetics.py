"""Earth's magnetic field from the World Magnetic Model, through `pygeomag`."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pygeomag import GeoMag

_GAUSS_PER_NANOTESLA = 1e-5


@lru_cache(maxsize=1)
def _model() -> GeoMag:
    return GeoMag(coefficients_file="wmm/WMM_2025.COF")


def magnetic_field_ned_gauss(
    lat_deg: float, lon_deg: float, alt_m: float, decimal_year: float
) -> NDArray[np.float64]:
    """Main field at a place and date (WMM-2025).

    Args:
        lat_deg, lon_deg: geodetic latitude and longitude, WGS84.
        alt_m: height; WMM takes it above the ellipsoid, and the geoid's 100 m make less than 3 nT.
        decimal_year: 2025.0 to 2030.0.

    Returns:
        Field (3,) in the local NED frame, gauss.

    Raises:
        ValueError: date outside the model's validity.
    """
    if not 2025.0 <= decimal_year <= 2030.0:
        raise ValueError(
            f"decimal year {decimal_year} is outside the magnetic model's validity, 2025.0 to 2030.0"
        )
    result = _model().calculate(
        glat=lat_deg, glon=lon_deg, alt=alt_m / 1000.0, time=decimal_year, allow_date_outside_lifespan=True
    )
    return np.array([result.x, result.y, result.z]) * _GAUSS_PER_NANOTESLA
