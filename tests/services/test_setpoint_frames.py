"""The fields of a streamed setpoint: which are used, and where they point in local NED."""

import math

import numpy as np
import pytest

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.inputs import setpoints as frames
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.commander.rig import ORIGIN
from tests.services.command_rig import ServiceRig

NAN = math.nan
ALL = 0b1111_1111_1111


def context() -> FlightContext:
    return ServiceRig("px4").context


def same(found: object, *wanted: float) -> bool:
    return found == pytest.approx(wanted, nan_ok=True)


@pytest.mark.parametrize(
    ("read", "bits", "limit"),
    [
        (frames.position_of, (1, 2, 4), 1e6),
        (frames.velocity_of, (8, 16, 32), 1e3),
        (frames.acceleration_of, (64, 128, 256), 1e3),
    ],
)
def test_each_component_has_its_bit_and_its_limit(read, bits, limit) -> None:
    assert same(read((1.0, -2.0, 3.0), ALL & ~sum(bits)), 1.0, -2.0, 3.0)
    for axis, bit in enumerate(bits):
        wanted = [1.0, -2.0, 3.0]
        wanted[axis] = NAN
        assert same(read((1.0, -2.0, 3.0), bit), *wanted)
        for value, used in ((limit, True), (-limit, True), (limit + 0.5, False), (-limit - 0.5, False)):
            values = [0.0, 0.0, 0.0]
            values[axis] = value
            assert math.isnan(read(tuple(values), 0)[axis]) != used
    assert same(read((NAN, math.inf, -math.inf), 0), NAN, NAN, NAN)


@pytest.mark.parametrize(
    ("yaw", "rate", "mask", "wanted"),
    [
        (0.5, 0.25, 0, (0.5, 0.25)),
        (0.5, 0.25, 1024, (NAN, 0.25)),
        (0.5, 0.25, 2048, (0.5, NAN)),
        (math.pi + 0.5, 0.0, 0, (0.5 - math.pi, 0.0)),
        (-math.pi - 0.5, 0.0, 0, (math.pi - 0.5, 0.0)),
        (1000.0, 1000.0, 0, (math.remainder(1000.0, math.tau), 1000.0)),
        (1000.5, -1000.5, 0, (NAN, NAN)),
        (NAN, math.inf, 0, (NAN, NAN)),
    ],
)
def test_yaw_is_wrapped_and_its_rate_is_not(yaw, rate, mask, wanted) -> None:
    assert same(frames.yaw_of(yaw, rate, mask), *wanted)


@pytest.mark.parametrize(
    ("heading_deg", "vector", "wanted"),
    [
        (0.0, (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)),
        (90.0, (1.0, 2.0, 3.0), (-2.0, 1.0, 3.0)),
        (90.0, (1.0, NAN, 3.0), (0.0, 1.0, 3.0)),
        (90.0, (NAN, 2.0, NAN), (-2.0, 0.0, NAN)),
        (90.0, (NAN, NAN, 3.0), (NAN, NAN, 3.0)),
        (30.0, (2.0, 0.0, 0.0), (math.sqrt(3.0), 1.0, 0.0)),
    ],
)
def test_forward_and_right_turn_with_the_heading(heading_deg, vector, wanted) -> None:
    found = frames.rotated_by_heading(vector, math.radians(heading_deg))
    assert found == pytest.approx(wanted, nan_ok=True, abs=1e-12)


def test_which_parts_of_a_target_are_controlled() -> None:
    for index in range(3):
        one = [NAN] * 3
        one[index] = 0.0
        parts = [frames.UNSET] * 3
        for kind in range(3):
            chosen = parts.copy()
            chosen[kind] = tuple(one)
            target = frames.Target(*chosen, 0.0, 0.0)  # type: ignore[call-arg]
            assert [target.has_position, target.has_velocity, target.has_acceleration] == [
                k == kind for k in range(3)
            ]


def test_the_vehicles_own_place_and_heading() -> None:
    ctx = context()
    ctx.nav[nav.POS_NED_M], ctx.nav[nav.EULER_RAD] = (1.0, 2.0, -3.0), (0.1, 0.2, 0.3)
    assert frames.place_of(ctx) == (1.0, 2.0, -3.0) and frames.heading_of(ctx) == 0.3


def place(ctx: FlightContext, lat_e7: int, lon_e7: int, altitude_m: float, *, relative: bool) -> object:
    return frames.local_from_global(ctx, lat_e7, lon_e7, altitude_m, relative=relative)


@pytest.mark.parametrize(("relative", "down_m"), [(False, -11.0), (True, -497.0)])
def test_an_altitude_is_over_the_sea_or_over_home(relative: bool, down_m: float) -> None:
    ctx = context()
    ctx.home_ned_m[:] = (0.0, 0.0, 3.0)
    assert ctx.frame is not None
    lat, lon, _ = ctx.frame.geodetic_from_ned(100.0, -50.0, 0.0)
    found = place(ctx, round(lat * 1e7), round(lon * 1e7), 500.0, relative=relative)
    assert found == pytest.approx((100.0, -50.0, down_m), abs=0.02)


@pytest.mark.parametrize(
    ("altitude_m", "known"), [(1e6, True), (-1e6, True), (1e6 + 1.0, False), (NAN, False), (math.inf, False)]
)
def test_an_altitude_has_limits(altitude_m: float, known: bool) -> None:
    lat_e7, lon_e7 = round(ORIGIN.lat_deg * 1e7), round(ORIGIN.lon_deg * 1e7)
    assert (place(context(), lat_e7, lon_e7, altitude_m, relative=False) is not None) == known


@pytest.mark.parametrize(
    ("lat_e7", "lon_e7", "known"),
    [
        (900_000_000, 1_800_000_000, True),
        (900_000_001, 1_800_000_000, False),
        (900_000_000, 1_800_000_001, False),
        (899_990_000, -1_800_000_000, True),
        (899_990_000, -1_800_000_001, False),
        (0, 0, False),  # more than 1000 km away
    ],
)
def test_a_place_is_on_earth_and_near(lat_e7: int, lon_e7: int, known: bool) -> None:
    ctx = context()
    ctx.frame = LocalFrame(GeodeticPosition(lat_deg=89.999, lon_deg=179.999, alt_m=0.0))
    assert (place(ctx, lat_e7, lon_e7, 10.0, relative=False) is not None) == known


def test_nothing_is_known_without_a_frame_or_home() -> None:
    ctx = context()
    ctx.home_ned_m[2] = NAN
    lat_e7, lon_e7 = round(ORIGIN.lat_deg * 1e7), round(ORIGIN.lon_deg * 1e7)
    assert place(ctx, lat_e7, lon_e7, 10.0, relative=True) is None
    assert place(ctx, lat_e7, lon_e7, 10.0, relative=False) is not None
    ctx.frame = None
    assert place(ctx, lat_e7, lon_e7, 10.0, relative=False) is None


@pytest.mark.parametrize(
    ("values", "valid"),
    [
        ([1.0, 0.0, 0.0, 0.0], True),
        ([0.0, 0.0, 0.0, 1.09], True),
        ([0.0, 0.91, 0.0, 0.0], True),
        ([0.0, 0.0, 1.11, 0.0], False),
        ([0.89, 0.0, 0.0, 0.0], False),
        ([NAN, 1.0, 0.0, 0.0], False),
        ([math.inf, 0.0, 0.0, 0.0], False),
    ],
)
def test_a_quaternion_is_normalised_within_its_tolerance(values: list[float], valid: bool) -> None:
    found = frames.unit_quaternion(values, 0.1)
    assert (found is not None) == valid
    if found is not None:
        assert float(np.linalg.norm(found)) == pytest.approx(1.0)
