"""Local frames against pymap3d's exact conversion on WGS84; gravity and rotation against published values."""

import math

import numpy as np
import pymap3d
import pytest

from flightsim.foundation.geodesy import (
    GeodeticPosition,
    LocalFrame,
    earth_rate_ned_rad_s,
    longitude_near,
    normal_gravity_m_s2,
)

ORIGINS = [
    GeodeticPosition(lat_deg=47.397742, lon_deg=8.545594, alt_m=488.0),
    GeodeticPosition(lat_deg=-35.363261, lon_deg=149.165230, alt_m=584.0),
    GeodeticPosition(lat_deg=0.0, lon_deg=179.9999, alt_m=0.0),
    GeodeticPosition(lat_deg=67.8, lon_deg=-20.2, alt_m=2500.0),
]
BEARINGS_RAD = [math.radians(degrees) for degrees in range(0, 360, 30)]


def horizontal_error_m(origin, distance_m, bearing_rad):
    """Distance between our point at (distance, bearing) and pymap3d's for the same latitude and longitude."""
    north, east = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
    lat, lon, alt = LocalFrame(origin).geodetic_from_ned(north, east, 0.0)
    exact = pymap3d.geodetic2ned(lat, lon, alt, origin.lat_deg, origin.lon_deg, origin.alt_m)
    return math.hypot(exact[0] - north, exact[1] - east)


@pytest.mark.parametrize("origin", ORIGINS, ids=lambda origin: f"{origin.lat_deg:g}")
@pytest.mark.parametrize("bearing_rad", BEARINGS_RAD)
def test_close_to_the_exact_tangent_plane(origin, bearing_rad):
    # The neglected terms are quadratic: tan(latitude) / radius times the square of the distance.
    scale = (1.0 + math.tan(math.radians(abs(origin.lat_deg)))) / 6.35e6
    for distance_m in (10.0, 100.0, 1000.0, 5000.0):
        assert horizontal_error_m(origin, distance_m, bearing_rad) <= 1.01 * scale * distance_m**2 + 1e-6


@pytest.mark.parametrize("origin", ORIGINS, ids=lambda origin: f"{origin.lat_deg:g}")
def test_there_and_back(origin):
    frame = LocalFrame(origin)
    for ned in [(0.0, 0.0, 0.0), (123.4, -567.8, -50.0), (-5000.0, 5000.0, 10.0)]:
        lat, lon, alt = frame.geodetic_from_ned(*ned)
        assert frame.ned_from_geodetic(lat, lon, alt) == pytest.approx(ned, abs=1e-6)


def test_across_the_date_line():
    frame = LocalFrame(GeodeticPosition(lat_deg=0.0, lon_deg=179.9999, alt_m=0.0))
    north, east, down = frame.ned_from_geodetic(0.0, -179.9999, 5.0)
    exact = pymap3d.geodetic2ned(0.0, -179.9999, 5.0, 0.0, 179.9999, 0.0)
    assert (north, east, down) == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize("lat_deg", [0.0, 89.0])
def test_a_track_across_the_date_line_is_converted_as_its_points_are(lat_deg):
    frame = LocalFrame(GeodeticPosition(lat_deg=lat_deg, lon_deg=179.9999, alt_m=20.0))
    track = np.linspace(-300.0, 300.0, 50), np.linspace(-400.0, 400.0, 50), np.linspace(0.0, -30.0, 50)
    lat, lon, alt = frame.geodetic_from_ned(*track)
    assert np.abs(lon).max() <= 180.0
    assert lon.min() < 0.0 < lon.max()
    np.testing.assert_allclose(frame.ned_from_geodetic(lat, lon, alt), track, atol=1e-6)
    assert frame.ned_from_geodetic(*(float(values[7]) for values in (lat, lon, alt))) == tuple(
        values[7] for values in frame.ned_from_geodetic(lat, lon, alt)
    )


def test_a_longitude_within_half_a_turn_is_left_exactly_as_it_is():
    within = np.random.default_rng(1).uniform(-180.0, 180.0, 1000)
    np.testing.assert_array_equal(longitude_near(within), within)
    assert longitude_near(180.001) == pytest.approx(-179.999)
    assert longitude_near(-179.5, 179.5) == pytest.approx(180.5)


def test_altitude_scales_the_frame():
    # One degree of latitude at 10 km height is longer by 10 km times one degree.
    low = LocalFrame(GeodeticPosition(lat_deg=45.0, lon_deg=7.0, alt_m=0.0))
    high = LocalFrame(GeodeticPosition(lat_deg=45.0, lon_deg=7.0, alt_m=10_000.0))
    gain = high.ned_from_geodetic(46.0, 7.0, 0.0)[0] - low.ned_from_geodetic(46.0, 7.0, 0.0)[0]
    assert gain == pytest.approx(math.radians(10_000.0))


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ((90.1, 0.0, 0.0), "latitude 90.1"),
        ((0.0, -180.5, 0.0), "longitude -180.5"),
        ((math.nan, 0.0, 0.0), "latitude nan"),
        ((0.0, 0.0, math.inf), "altitude inf"),
    ],
)
def test_impossible_positions_are_named(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        GeodeticPosition(lat_deg=values[0], lon_deg=values[1], alt_m=values[2])


@pytest.mark.parametrize(
    ("lat_deg", "gravity"), [(0.0, 9.7803253359), (90.0, 9.8321849378), (45.0, 9.8061977694)]
)
def test_gravity_on_the_ellipsoid(lat_deg, gravity):
    # NGA.STND.0036, table 3.4 (equator, pole); 45 deg from the closed formula of the same standard
    assert normal_gravity_m_s2(lat_deg, 0.0) == pytest.approx(gravity, abs=2e-7)


def test_gravity_falls_with_height():
    # free-air gradient, 3.086e-6 1/s^2
    assert normal_gravity_m_s2(45.0, 0.0) - normal_gravity_m_s2(45.0, 1000.0) == pytest.approx(
        3.086e-3, rel=2e-3
    )


def test_earth_rate_points_to_the_north_pole():
    north, east, down = earth_rate_ned_rad_s(30.0)
    assert math.hypot(north, down) == pytest.approx(7.292115e-5)
    assert east == 0.0
    assert math.degrees(math.atan2(-down, north)) == pytest.approx(30.0)
