"""Earth models against published values."""

import math

import pytest

from autopilot_bridge.navigation.earth import (
    earth_rate_ned_rad_s,
    normal_gravity_m_s2,
    pressure_altitude_m,
)


@pytest.mark.parametrize(
    ("lat_deg", "gravity"), [(0.0, 9.7803253359), (90.0, 9.8321849378), (45.0, 9.8061977694)]
)
def test_gravity_on_the_ellipsoid(lat_deg: float, gravity: float) -> None:
    # NGA.STND.0036, table 3.4 (equator, pole); 45 deg from the closed formula of the same standard
    assert normal_gravity_m_s2(lat_deg, 0.0) == pytest.approx(gravity, abs=2e-7)


def test_gravity_falls_with_height() -> None:
    # free-air gradient, 3.086e-6 1/s^2
    assert normal_gravity_m_s2(45.0, 0.0) - normal_gravity_m_s2(45.0, 1000.0) == pytest.approx(
        3.086e-3, rel=2e-3
    )


def test_earth_rate_points_to_the_north_pole() -> None:
    north, east, down = earth_rate_ned_rad_s(30.0)
    assert math.hypot(north, down) == pytest.approx(7.292115e-5)
    assert east == 0.0
    assert math.degrees(math.atan2(-down, north)) == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("pressure_pa", "altitude_m"),
    [(101325.0, 0.0), (89874.6, 1000.0), (79495.2, 2000.0), (54019.9, 5000.0), (107477.0, -500.0)],
)
def test_pressure_altitude(pressure_pa: float, altitude_m: float) -> None:
    assert pressure_altitude_m(pressure_pa) == pytest.approx(altitude_m, abs=0.6)  # ISO 2533, table 5


@pytest.mark.parametrize("pressure_pa", [0.0, -5.0, math.nan, math.inf, 3e5])
def test_pressures_that_make_no_sense(pressure_pa: float) -> None:
    assert math.isnan(pressure_altitude_m(pressure_pa))
