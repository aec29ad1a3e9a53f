"""The magnetic field against the official WMM2025 test values (NOAA/NCEI WMM2025_TestValues)."""

import numpy as np
import pytest

from flightsim.foundation.magnetics import magnetic_field_ned_gauss

# decimal year, height km, latitude, longitude, X, Y, Z in nT
OFFICIAL = [
    (2025.0, 0.0, 80.0, 0.0, 6521.6, 145.9, 54791.5),
    (2025.0, 0.0, 0.0, 120.0, 39677.8, -109.6, -10580.2),
    (2025.0, 0.0, -80.0, 240.0, 6117.5, 15751.9, -52022.5),
    (2025.0, 100.0, 80.0, 0.0, 6216.0, 92.4, 52598.8),
    (2025.0, 100.0, 0.0, 120.0, 37688.6, -96.2, -10152.1),
    (2025.0, 100.0, -80.0, 240.0, 5907.6, 14780.3, -49540.7),
    (2027.5, 0.0, 80.0, 0.0, 6500.8, 294.5, 54869.4),
    (2027.5, 0.0, 0.0, 120.0, 39701.6, -167.4, -10381.8),
    (2027.5, 0.0, -80.0, 240.0, 6200.7, 15730.3, -51783.7),
]


@pytest.mark.parametrize(("year", "height_km", "lat", "lon", "x", "y", "z"), OFFICIAL)
def test_official_values(
    year: float, height_km: float, lat: float, lon: float, x: float, y: float, z: float
) -> None:
    field = magnetic_field_ned_gauss(lat, lon, 1000.0 * height_km, year)
    np.testing.assert_allclose(field * 1e5, [x, y, z], atol=0.06)


@pytest.mark.parametrize("year", [2024.9, 2030.1])
def test_dates_outside_the_model_are_refused(year: float) -> None:
    with pytest.raises(ValueError, match=r"2025\.0 to 2030\.0"):
        magnetic_field_ned_gauss(0.0, 0.0, 0.0, year)
