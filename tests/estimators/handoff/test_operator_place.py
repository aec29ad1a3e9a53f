"""The place that the operator names, as the aircraft that looks for it sees it."""

import math

import pytest

from estimators.handoff.operator_place import OperatorPlace
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.geodetic_position import GeodeticPosition
from tests.estimators.attitude.made import made

HOME = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=2500.0)


def at(place, north_m, east_m, height_m, yaw_rad):
    """Give the aircraft's own position and heading, as messages."""
    latitude_deg, longitude_deg, altitude_m = LocalFrame(HOME).geodetic_from_ned(north_m, east_m, -height_m)
    home = {"latitude": 470000000, "longitude": 80000000, "altitude": 2500000}
    place.take(0, made("HOME_POSITION", **home))
    position = {"lat": round(1e7 * latitude_deg), "lon": round(1e7 * longitude_deg)}
    place.take(0, made("GLOBAL_POSITION_INT", **position, alt=round(1e3 * altitude_m)))
    place.take(0, made("ATTITUDE", yaw=yaw_rad))


@pytest.mark.parametrize(
    ("yaw_rad", "forward_m", "right_m"),
    [(0.0, -3000.0, 2500.0), (0.5 * math.pi, 2500.0, 3000.0), (math.pi, 3000.0, -2500.0)],
)
def test_place_is_forward_and_right_of_the_aircraft_above_a_high_home(yaw_rad, forward_m, right_m):
    """3 km away from a home at 2500 m, the altitude of home by a wrong unit moves the place by a metre."""
    place = OperatorPlace(1000.0, 500.0)
    at(place, 4000.0, -2000.0, 3000.0, yaw_rad)
    assert place.level(0) == pytest.approx((forward_m, right_m), abs=0.05)


def test_no_place_is_below_the_aircraft():
    assert OperatorPlace(None, None).level(0) == (0.0, 0.0)


def test_an_old_position_gives_no_place():
    place = OperatorPlace(1000.0, 500.0)
    assert place.level(0) is None
    at(place, 0.0, 0.0, 100.0, 0.0)
    assert place.level(1_000_000) is not None
    assert place.level(1_000_001) is None
