"""Places, velocities and headings of messages, in SI units. A place that is not on the Earth is None."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import (
    degrees,
    e7,
    heading_of,
    home_of,
    place,
    place_columns,
    place_of,
    velocity_of,
)
from estimators import wire
from flightsim.foundation.geodesy import GeodeticPosition

ZURICH = (473_977_420, 85_455_940, 488_123)
OUTSIDE = [(900_000_001, 0, 0), (0, -1_800_000_001, 0), (2**31 - 1, 2**31 - 1, 0)]


def position(lat: int, lon: int, alt: int, hdg: int = 0) -> dialect.MAVLink_global_position_int_message:
    return dialect.MAVLink_global_position_int_message(0, lat, lon, alt, 0, 100, -250, 5, hdg)


def origin(lat: int, lon: int, alt: int) -> dialect.MAVLink_gps_global_origin_message:
    return dialect.MAVLink_gps_global_origin_message(lat, lon, alt, 0)


def test_a_message_of_a_link_and_a_row_of_a_log_are_read_alike() -> None:
    expected = GeodeticPosition(lat_deg=47.397742, lon_deg=8.545594, alt_m=488.123)
    row = wire.GLOBAL_POSITION_INT(1, 1, 0, *ZURICH, 0, 100, -250, 5, 9000)  # type: ignore[call-arg]
    for message in (position(*ZURICH, hdg=9000), row):
        assert place_of(message) == expected
        assert velocity_of(message) == (1.0, -2.5, 0.05)
        assert heading_of(message) == math.pi / 2
    assert home_of(origin(*ZURICH)) == expected


@pytest.mark.parametrize("numbers", OUTSIDE)
def test_a_place_that_is_not_on_the_earth_is_none(numbers: tuple[int, int, int]) -> None:
    assert place(*numbers) is place_of(position(*numbers)) is home_of(origin(*numbers)) is None


def test_the_edges_of_the_earth_are_places_and_no_home_is_at_0_0() -> None:
    assert place(-900_000_000, 1_800_000_000, 0) == GeodeticPosition(lat_deg=-90.0, lon_deg=180.0, alt_m=0.0)
    assert place(0, 0, 5000) is not None and home_of(origin(0, 0, 5000)) is None


@pytest.mark.parametrize("hdg", [36_001, 65_535])
def test_a_heading_may_be_unknown(hdg: int) -> None:
    assert math.isnan(heading_of(position(*ZURICH, hdg=hdg)))


def test_every_degree_e7_survives_both_ways() -> None:
    whole = np.random.default_rng(5).integers(-1_800_000_000, 1_800_000_001, 2000)
    assert [e7(degrees(int(value))) for value in whole] == whole.tolist()


def test_columns_are_read_as_messages_are() -> None:
    table = np.array([ZURICH, OUTSIDE[0]], [("lat", "<i4"), ("lon", "<i4"), ("alt", "<i4")])
    lat_deg, lon_deg, alt_m = place_columns(table)
    assert (lat_deg[0], lon_deg[0], alt_m[0]) == (47.397742, 8.545594, 488.123) and lat_deg[1] > 90.0
