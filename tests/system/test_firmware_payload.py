"""The devices that are carried along with a firmware's simulated vehicle."""

import math

import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from benchmarks.firmware_payload import (
    CASES,
    STEP_US,
    CarriedPayload,
    State,
    VehicleTime,
    named_places,
    state_of,
    true_places,
    world_of,
)
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.home import Home

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=489.0)
FRAME = LocalFrame(GeodeticPosition(lat_deg=HOME.lat_deg, lon_deg=HOME.lon_deg, alt_m=HOME.alt_m))


def frame_of(message):
    (frame,) = FrameParser().feed(FrameEncoder(1, 1).encode(message))
    return frame


def hold(carried, north_m, east_m, *, height_m):
    lat_deg, lon_deg, alt_m = FRAME.geodetic_from_ned(north_m, east_m, -height_m)
    for k in range(60):
        carried.follow(
            State(
                time_us=7_003_000 + STEP_US * k,
                lat_deg=lat_deg,
                lon_deg=lon_deg,
                alt_m=alt_m,
                vel_ned_m_s=(0.0, 0.0, 0.0),
                q_ned_from_frd=(1.0, 0.0, 0.0, 0.0),
                rates_frd_rad_s=(0.0, 0.0, 0.0),
            )
        )


def test_the_tag_below_the_vehicle_is_reported_at_the_times_of_the_firmware():
    case = CASES["parallel-sweep"]
    world = world_of([*case.arguments["copter"], *case.world], HOME, 1)
    sent = []
    carried = CarriedPayload(world, sent.append)
    ((north_m, east_m),) = true_places(world)
    hold(carried, north_m, east_m, height_m=10.0)
    messages = [decode(frame) for frame in FrameParser().feed(b"".join(sent))]
    tags = [message for message in messages if message.get_type() == "LANDING_TARGET"]
    assert len(tags) >= 5
    assert all(math.hypot(tag.angle_x, tag.angle_y) < 0.05 for tag in tags)  # type: ignore[attr-defined]
    assert all(7_000_000 < tag.time_usec < 8_300_000 for tag in tags)  # type: ignore[attr-defined]


@pytest.mark.parametrize("vehicle", ["copter", "plane"])
def test_the_magnetometer_measures_the_target_below_it_beside_the_published_map(vehicle):
    case = CASES["occupancy"]
    world = world_of([*case.arguments[vehicle], *case.world], HOME, 1)
    sent = []
    carried = CarriedPayload(world, sent.append)
    north_m, east_m = true_places(world)[0]
    hold(carried, north_m, east_m, height_m=80.0)
    messages = [decode(frame) for frame in FrameParser().feed(b"".join(sent))]
    readings = [message.value for message in messages if message.get_type() == "NAMED_VALUE_FLOAT"]  # type: ignore[attr-defined]
    assert len(readings) >= 5
    map_nt = carried.published_map.total_at_nt(north_m, east_m)
    assert all(abs(reading - map_nt - 30.0) < 10.0 for reading in readings)


@pytest.mark.parametrize("firmware", ["px4", "ardupilot"])
def test_the_true_state_of_both_firmwares_has_the_time_of_the_vehicles_messages(firmware):
    quaternion, rates = (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.3)
    if firmware == "px4":
        message = dialect.MAVLink_hil_state_quaternion_message(
            0, quaternion, *rates, 474_000_000, 85_000_000, 489_000, 100, -200, 0, 0, 0, 0, 0, 0
        )
    else:
        message = dialect.MAVLink_sim_state_message(
            *quaternion, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8, *rates, 47.4, 8.5, 489.0, 0.0, 0.0, 1.0, -2.0, 0.0
        )
        message.lat_int, message.lon_int = 474_000_000, 85_000_000  # type: ignore[attr-defined]
    clock = VehicleTime()
    assert state_of(frame_of(message), clock) is None  # the time is not known yet
    assert state_of(frame_of(dialect.MAVLink_attitude_message(5_000, 0, 0, 0, 0, 0, 0)), clock) is None
    state = state_of(frame_of(message), clock)
    assert (state.lat_deg, state.lon_deg, state.alt_m) == pytest.approx((47.4, 8.5, 489.0))
    assert state.vel_ned_m_s == pytest.approx((1.0, -2.0, 0.0))
    assert state.rates_frd_rad_s == pytest.approx(rates)
    assert 5_000_000 <= state.time_us < 6_000_000


def test_the_named_places_are_those_of_the_search_or_of_the_list():
    assert named_places({"search": {"north_m": 1.0, "east_m": 2.0}, "north_m": None}) == [(1.0, 2.0)]
    assert named_places({"north_m": 3.0, "east_m": 4.0}) == [(3.0, 4.0)]
    assert named_places({"north_m": None, "east_m": None}) == []
    assert named_places({"target_estimate_m": {"north": 5.0, "east": 6.0}}) == [(5.0, 6.0)]
    assert named_places({"target_estimate_m": None}) == []
    listed = {"anomalies": [{"north": 1.0, "east": 2.0}, {"north": 3.0, "east": 4.0}]}
    assert named_places(listed) == [(1.0, 2.0), (3.0, 4.0)]
