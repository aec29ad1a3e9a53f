"""pymavlink's mavutil flies PX4's fixed wing: the whole of a mission, and what a script commands in the air.

Tests in the air share one aircraft: each takes it over from wherever the one before has left it.
"""

import math
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.aircraft_client import AircraftClient, aircraft

NAN = math.nan
QUIET = (
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU,
    mavlink.MAVLINK_MSG_ID_ODOMETRY,
)
"""Fast messages that the client does not read here: without them, Python keeps up."""
SLOWER_HZ = {mavlink.MAVLINK_MSG_ID_ATTITUDE: 20.0, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0}
VELOCITY_ONLY = 0b110111000111


@pytest.fixture(scope="module")
def parked() -> Iterator[AircraftClient]:
    with aircraft("px4") as client:
        for message_id in QUIET:
            client.message_rate(message_id, 0.0)
        for message_id, rate_hz in SLOWER_HZ.items():
            client.message_rate(message_id, rate_hz)
        client.ready()
        yield client


@pytest.fixture(scope="module")
def flying(parked: AircraftClient) -> AircraftClient:
    """Taken off from the runway by command, to the place and the height it was reported."""
    place = parked.runway.along(400.0, 100.0)
    lat, lon, height_m = parked.geodetic(place, parked.runway.alt_m + 60.0)
    parked.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, lat, lon, height_m)
    parked.arm()
    parked.sees_mode("TAKEOFF")
    parked.circles(place, parked.parameter("NAV_LOITER_RAD"), 60.0)
    parked.sees_mode("LOITER")
    return parked


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="mission", vehicle="px4-plane")
@pytest.mark.slow
def test_mission_from_take_off_to_auto_disarm() -> None:
    with aircraft("px4") as client:
        client.ready()
        items = client.runway.circuit(client.flavour)
        client.upload(items)
        client.set_mode("MISSION")
        client.arm()
        land = len(items) - 1
        client.next("MISSION_ITEM_REACHED", lambda m: m.seq == 1)
        client.next("EXTENDED_SYS_STATE", lambda m: m.landed_state == mavlink.MAV_LANDED_STATE_LANDING)
        client.next("MISSION_CURRENT", lambda m: m.seq == land)
        client.next("EXTENDED_SYS_STATE", lambda m: m.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND)
        client.landed_and_disarmed()
        place = client.next("GLOBAL_POSITION_INT")
        assert client.distance_m(place, client.runway.along(50.0)) < 100.0
        said = ("Takeoff on runway", "Takeoff detected", "Landing, flaring", "Landing detected")
        assert [text for text in client.texts if text in said] == list(said)


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
@pytest.mark.slow
def test_reposition_does_not_read_a_radius(flying: AircraftClient) -> None:
    place = flying.runway.along(300.0, -200.0)
    lat, lon, height_m = flying.geodetic(place, flying.runway.alt_m + 80.0)
    flying.command(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, -120.0, NAN, lat, lon, height_m)
    flying.circles(place, flying.parameter("NAV_LOITER_RAD"), 80.0)
    flying.sees_mode("LOITER")


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_orbit(flying: AircraftClient) -> None:
    place = flying.runway.along(500.0, 0.0)
    lat, lon, height_m = flying.geodetic(place, flying.runway.alt_m + 70.0)
    flying.command(mavlink.MAV_CMD_DO_ORBIT, 100.0, 22.0, 0, 0, lat, lon, height_m)
    flying.circles(place, 100.0, 70.0)
    flying.sees_mode("LOITER")
    status = flying.next("ORBIT_EXECUTION_STATUS")
    assert status.radius == pytest.approx(100.0)
    assert (status.x * 1e-7, status.y * 1e-7) == pytest.approx((lat, lon), abs=1e-6)


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_airspeed(flying: AircraftClient) -> None:
    flying.set_mode("LOITER")
    for airspeed_m_s in (21.0, 26.0):
        flying.command(mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, airspeed_m_s, -1)
        flying.flies_at(airspeed_m_s)


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_offboard_attitudes(flying: AircraftClient) -> None:
    for roll_deg in (20.0, -25.0):

        def each(roll_deg: float = roll_deg) -> None:
            flying.send_attitude(roll_deg, 4.0, 0.8)

        flying.stream_for(0.5, each)  # OFFBOARD wants to see a stream first
        flying.set_mode("OFFBOARD", each)
        flying.banks(roll_deg, each=each)
    flying.set_mode("LOITER")


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_offboard_position_is_circled(flying: AircraftClient) -> None:
    place = flying.runway.along(200.0, 300.0)

    def each() -> None:
        flying.send_position(*place, 90.0)

    flying.stream_for(0.5, each)
    flying.set_mode("OFFBOARD", each)
    flying.circles(place, flying.parameter("NAV_LOITER_RAD"), 90.0, each=each)


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_offboard_velocity_is_a_course(flying: AircraftClient) -> None:
    def each() -> None:
        frame = mavlink.MAV_FRAME_LOCAL_NED
        flying.link.mav.set_position_target_local_ned_send(
            0, 1, 1, frame, VELOCITY_ONLY, 0, 0, 0, -15.0, -18.0, 0.0, 0, 0, 0, 0, 0
        )

    flying.stream_for(0.5, each)
    flying.set_mode("OFFBOARD", each)
    course = math.atan2(-18.0, -15.0)
    flying.holds(
        "course",
        3.0,
        "GLOBAL_POSITION_INT",
        lambda m: abs(math.remainder(math.atan2(m.vy, m.vx) - course, math.tau)) < math.radians(5.0),
        each,
    )


@pytest.mark.slow
@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="px4-plane")
def test_return(flying: AircraftClient) -> None:
    flying.set_mode("RTL")
    flying.circles((0.0, 0.0), flying.parameter("NAV_LOITER_RAD"), flying.parameter("RTL_RETURN_ALT"))
