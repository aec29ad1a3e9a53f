"""The firmwares' projections, against spherical trigonometry and against what ArduPilot's source says."""

import math
from typing import Final

import numpy as np
import pytest

from flightsim.foundation.firmware_frames import ArduPilotFrame, FirmwareFrame, Px4Frame
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

ZURICH: Final = GeodeticPosition(lat_deg=47.397742, lon_deg=8.545594, alt_m=488.0)
CANBERRA: Final = GeodeticPosition(lat_deg=-35.363262, lon_deg=149.165237, alt_m=584.0)
DATE_LINE: Final = GeodeticPosition(lat_deg=60.0, lon_deg=179.999, alt_m=0.0)
KINDS: Final = (Px4Frame, ArduPilotFrame)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("origin", [ZURICH, CANBERRA, DATE_LINE])
def test_a_place_comes_back_from_its_position(kind: type[FirmwareFrame], origin: GeodeticPosition) -> None:
    frame = kind(origin)
    position = (5000.0, -4000.0, -100.0)
    lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(*position)
    assert -180.0 <= lon_deg < 180.0 and alt_m == origin.alt_m + 100.0
    assert frame.ned_from_geodetic(lat_deg, lon_deg, alt_m) == pytest.approx(position, abs=1e-6)
    assert frame.ned_from_geodetic(origin.lat_deg, origin.lon_deg, origin.alt_m) == (0.0, 0.0, 0.0)


def test_px4_keeps_distance_and_bearing_on_a_sphere() -> None:
    lat, lon = math.radians(47.43), math.radians(8.61)
    here, there = math.radians(ZURICH.lat_deg), math.radians(ZURICH.lon_deg)
    haversine = (
        math.sin(0.5 * (lat - here)) ** 2
        + math.cos(lat) * math.cos(here) * math.sin(0.5 * (lon - there)) ** 2
    )
    bearing_rad = math.atan2(
        math.sin(lon - there) * math.cos(lat),
        math.cos(here) * math.sin(lat) - math.sin(here) * math.cos(lat) * math.cos(lon - there),
    )
    north_m, east_m, _ = Px4Frame(ZURICH).ned_from_geodetic(47.43, 8.61, 488.0)
    assert math.hypot(north_m, east_m) == pytest.approx(2.0 * 6_371_000.0 * math.asin(haversine**0.5), 1e-9)
    assert math.atan2(east_m, north_m) == pytest.approx(bearing_rad, abs=1e-9)


def test_ardupilots_degrees_have_the_length_of_its_source() -> None:
    north_m, east_m, _ = ArduPilotFrame(CANBERRA).ned_from_geodetic(-35.353262, 149.175237, 584.0)
    assert north_m == pytest.approx(100_000 * 0.011131884502145034)
    assert east_m == pytest.approx(100_000 * 0.011131884502145034 * math.cos(math.radians(-35.358262)))


@pytest.mark.parametrize(
    ("kind", "origin", "stretch"),
    [
        (Px4Frame, ZURICH, (1.00007, 0.99699)),
        (ArduPilotFrame, ZURICH, (1.00118, 0.99810)),
        (ArduPilotFrame, CANBERRA, (1.00336, 0.99889)),
        (LocalFrame, ZURICH, (1.0, 1.0)),
    ],
)
def test_the_stretch_is_that_of_short_ways(
    kind: type[LocalFrame], origin: GeodeticPosition, stretch: tuple[float, float]
) -> None:
    lat_deg, lon_deg, _ = LocalFrame(origin).geodetic_from_ned(1.0, 1.0, 0.0)
    north_m, east_m, _ = kind(origin).ned_from_geodetic(lat_deg, lon_deg, origin.alt_m)
    assert kind(origin).stretch == pytest.approx((north_m, east_m), abs=1e-6)
    assert kind(origin).stretch == pytest.approx(stretch, abs=1.5e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_arrays_are_converted_as_their_places(kind: type[FirmwareFrame]) -> None:
    frame = kind(ZURICH)
    lat_deg, lon_deg, alt_m = np.array([47.3, 47.5]), np.array([8.5, 8.6]), np.array([0.0, 900.0])
    north_m, east_m, down_m = frame.ned_from_geodetic(lat_deg, lon_deg, alt_m)
    assert (north_m[1], east_m[1], down_m[1]) == frame.ned_from_geodetic(47.5, 8.6, 900.0)
    back = frame.geodetic_from_ned(north_m, east_m, down_m)
    np.testing.assert_allclose(back, (lat_deg, lon_deg, alt_m), atol=1e-12)
