"""pymavlink's mavutil flies ArduPlane: AUTO from the runway and back to it, and scripted in the air.

Tests in the air share one aircraft: each takes it over from wherever the one before has left it.
"""

import math
from collections.abc import Callable, Iterator

import pytest
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.aircraft_client import AircraftClient, aircraft

RADIUS_M, HEIGHT_M = 110.0, 80.0
NO_RATES = 0x07
NO_RATES_NO_THROTTLE = 0x47
ROLL_ONLY = 0xC6
"""type_mask of SET_ATTITUDE_TARGET: what is left to the autopilot."""


@pytest.fixture(scope="module")
def flying() -> Iterator[AircraftClient]:
    """Taken off in TAKEOFF, circling where and as high as that mode does."""
    with aircraft("ardupilot") as client:
        client.ready()
        client.set_mode("TAKEOFF")
        client.arm()
        client.climbs_to(client.parameter("TKOFF_ALT") - 5.0)
        yield client


@pytest.fixture
def guided(flying: AircraftClient) -> AircraftClient:
    flying.set_mode("GUIDED")
    return flying


def sent(client: AircraftClient, roll_deg: float, thrust: float, type_mask: int) -> Callable[[], None]:
    """A stream of attitudes, slightly nose-up."""
    return lambda: client.send_attitude(roll_deg, 5.0, thrust, type_mask)


@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="mission", vehicle="ardupilot-plane")
def test_auto_from_take_off_to_auto_disarm() -> None:
    with aircraft("ardupilot") as client:
        client.ready()
        items = client.runway.circuit(client.flavour)
        client.upload(items)
        client.set_mode("AUTO")
        assert client.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_FAILED
        client.link.param_set_send("RTL_AUTOLAND", 3)
        client.next("PARAM_VALUE", lambda m: m.param_id == "RTL_AUTOLAND" and m.param_value == 3)
        client.arm()
        for seq in range(1, len(items)):
            if items[seq + 1 : seq + 2] and items[seq + 1].command == mavlink.MAV_CMD_DO_LAND_START:
                continue  # of a waypoint and the DO_ item behind it the firmware reports the latter alone
            client.next("MISSION_ITEM_REACHED", lambda m, seq=seq: m.seq == seq)
        client.landed_and_disarmed()
        place = client.next("GLOBAL_POSITION_INT")
        assert client.distance_m(place, client.runway.along(50.0)) < 100.0
        assert "Arm: DO_LAND_START set and RTL_AUTOLAND disabled" in client.texts
        assert "Auto disarmed" in client.texts


@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
@pytest.mark.slow
def test_reposition_with_radius_and_direction(flying: AircraftClient) -> None:
    for place, clockwise in (
        (flying.runway.along(300.0, 200.0), 1.0),
        (flying.runway.along(400.0, -200.0), -1.0),
    ):
        direction = 0.0 if clockwise > 0.0 else 1.0
        result = flying.result_int(
            mavlink.MAV_CMD_DO_REPOSITION, flying.geodetic(place, HEIGHT_M), -1.0, 1.0, RADIUS_M, direction
        )
        assert result == mavlink.MAV_RESULT_ACCEPTED
        flying.circles(place, clockwise * RADIUS_M, HEIGHT_M)
    flying.sees_mode("GUIDED")


@pytest.mark.parametrize("heading_deg", [90.0, 350.0])
@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
def test_heading(guided: AircraftClient, heading_deg: float) -> None:
    guided.command(mavlink.MAV_CMD_GUIDED_CHANGE_HEADING, 1, heading_deg, 5.0)
    guided.holds(
        "heading",
        5.0,
        "ATTITUDE",
        lambda m: abs(math.remainder(m.yaw - math.radians(heading_deg), math.tau)) < math.radians(3.0),
    )


@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
def test_altitude_and_airspeed(guided: AircraftClient) -> None:
    guided.command(mavlink.MAV_CMD_GUIDED_CHANGE_ALTITUDE, 0, 0, 0, 0, 0, 0, 110.0)
    guided.command(mavlink.MAV_CMD_GUIDED_CHANGE_SPEED, 0, 21.0, 0.0)
    guided.holds("height", 5.0, "GLOBAL_POSITION_INT", lambda m: abs(m.relative_alt * 1e-3 - 110.0) < 3.0)
    guided.flies_at(21.0)


@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
def test_attitude_with_throttle(guided: AircraftClient) -> None:
    for roll_deg, throttle in ((25.0, 0.9), (-25.0, 0.7)):
        each = sent(guided, roll_deg, throttle, NO_RATES)
        guided.banks(roll_deg, each=each)
        guided.next("VFR_HUD", lambda m, throttle=throttle: abs(m.throttle - 100.0 * throttle) <= 1, each)


def test_attitude_and_the_autopilots_throttle(guided: AircraftClient) -> None:
    each = sent(guided, 20.0, 0.0, NO_RATES_NO_THROTTLE)
    guided.banks(20.0, seconds=5.0, each=each)
    guided.next("VFR_HUD", lambda m: m.throttle > 30, each)


def test_roll_alone(guided: AircraftClient) -> None:
    each = sent(guided, -30.0, 0.0, ROLL_ONLY)
    guided.banks(-30.0, each=each)
    height_m = guided.next("GLOBAL_POSITION_INT").relative_alt * 1e-3
    guided.holds(
        "height", 10.0, "GLOBAL_POSITION_INT", lambda m: abs(m.relative_alt * 1e-3 - height_m) < 10.0, each
    )
    guided.banks(-30.0, each=each)


def test_attitudes_that_stop_leave_the_circle_commanded_before(flying: AircraftClient) -> None:
    place = flying.runway.along(300.0, 0.0)
    flying.result_int(
        mavlink.MAV_CMD_DO_REPOSITION, flying.geodetic(place, HEIGHT_M), -1.0, 1.0, RADIUS_M, 0.0
    )
    flying.sees_mode("GUIDED")
    flying.banks(-30.0, each=sent(flying, -30.0, 0.8, NO_RATES))
    flying.circles(place, RADIUS_M, HEIGHT_M)


@pytest.mark.parametrize("by", ["override", "manual control"])
@pytest.mark.compatibility(
    client="pymavlink (mavutil)",
    feature="sticks: RC_CHANNELS_OVERRIDE, MANUAL_CONTROL",
    vehicle="ardupilot-plane",
)
def test_sticks_in_fbwa(flying: AircraftClient, by: str) -> None:
    flying.set_mode("FBWA")
    limit_deg = flying.parameter("ROLL_LIMIT_DEG")
    link = flying.link.mav

    def each() -> None:
        if by == "override":
            link.rc_channels_override_send(1, 1, 1750, 1500, 1800, 1500, 0, 0, 0, 0)
        else:
            link.manual_control_send(1, 0, 500, 800, 0, 0)

    flying.banks(0.5 * limit_deg, each=each)
    flying.link.mav.rc_channels_override_send(1, 1, *(0,) * 8)


@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
def test_loiter(flying: AircraftClient) -> None:
    flying.set_mode("LOITER")
    before = flying.next("GLOBAL_POSITION_INT")
    flying.holds("bank", 10.0, "ATTITUDE", lambda m: m.roll > math.radians(10.0))
    after = flying.next("GLOBAL_POSITION_INT")
    assert abs(after.relative_alt - before.relative_alt) < 15_000


@pytest.mark.slow
@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="setpoints, modes", vehicle="ardupilot-plane"
)
def test_return(flying: AircraftClient) -> None:
    flying.set_mode("RTL")
    radius_m = flying.parameter("WP_LOITER_RAD")
    flying.circles((0.0, 0.0), radius_m, flying.parameter("RTL_ALTITUDE"), within_m=20.0)
