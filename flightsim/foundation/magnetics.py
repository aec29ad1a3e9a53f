"""Earth's main field: the World Magnetic Model (`pygeomag`), and the IGRF (`ppigrf`, an extra)."""

from datetime import datetime, timedelta
from enum import StrEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pygeomag import GeoMag

from flightsim.foundation.packages import MissingPackage, required

_GAUSS_PER_NANOTESLA = 1e-5


@lru_cache(maxsize=1)
def _model() -> GeoMag:
    return GeoMag(coefficients_file="wmm/WMM_2025.COF")


def require_wmm_year(decimal_year: float) -> None:
    """Refuse a date for which WMM-2025 is not valid.

    Raises:
        ValueError: names the date and the years that are accepted.
    """
    if not 2025.0 <= decimal_year <= 2030.0:
        raise ValueError(
            f"decimal year {decimal_year} is outside the magnetic model's validity, 2025.0 to 2030.0"
        )


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
    require_wmm_year(decimal_year)
    result = _model().calculate(
        glat=lat_deg, glon=lon_deg, alt=alt_m / 1000.0, time=decimal_year, allow_date_outside_lifespan=True
    )
    return np.array([result.x, result.y, result.z]) * _GAUSS_PER_NANOTESLA


class FieldModel(StrEnum):
    """Models of the main field."""

    WMM = "wmm"
    IGRF = "igrf"


def main_field_ned_gauss(
    lat_deg: float, lon_deg: float, alt_m: float, decimal_year: float, model: FieldModel = FieldModel.WMM
) -> NDArray[np.float64]:
    """Main field at a place and date by one of the models; see `magnetic_field_ned_gauss`.

    Args:
        decimal_year: 1900.0 to 2030.0 for the IGRF (its 14th generation).

    Raises:
        ValueError: date outside the model's validity, or `ppigrf` is not installed.
    """
    if model is FieldModel.WMM:
        return magnetic_field_ned_gauss(lat_deg, lon_deg, alt_m, decimal_year)
    if not 1900.0 <= decimal_year <= 2030.0:
        raise ValueError(f"decimal year {decimal_year} is outside the IGRF's validity, 1900.0 to 2030.0")
    try:
        ppigrf = required("ppigrf", "the IGRF")
    except MissingPackage as error:
        raise ValueError(str(error)) from None
    year = int(decimal_year)
    start = datetime(year, 1, 1)
    length = datetime(year + 1, 1, 1) - start
    date = start + timedelta(seconds=(decimal_year - year) * length.total_seconds())
    east, north, up = (
        float(np.ravel(part)[0]) for part in ppigrf.igrf(lon_deg, lat_deg, alt_m / 1000.0, date)
    )
    return np.array([north, east, -up]) * _GAUSS_PER_NANOTESLA
