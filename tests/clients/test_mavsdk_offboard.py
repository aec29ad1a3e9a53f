"""Every setpoint of MAVSDK's offboard plugin, by both of its interfaces, on both flavours."""

import math
from collections.abc import Callable
from typing import Any, Final

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from tests.clients.compatibility import not_offered
from tests.clients.mavsdk_flying import DEG_PER_M, HEIGHT_M, fly, moved
from tests.clients.mavsdk_session import Session

compatibility = pytest.mark.compatibility
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["px4", "ardupilot"])
def vehicle(request: pytest.FixtureRequest) -> str:
    """Copters; aircraft are flown in a module of their own."""
    return str(request.param)


def _setpoints(vehicle: str) -> dict[str, tuple[str, tuple[Any, ...], Callable[[Any, Any], bool]]]:
    from mavsdk.plugins import offboard as o

    place = o.PositionNedYaw(6.0, -4.0, -10.0, 0.0)

    def at_place(start: Any, at: Any) -> bool:
        return math.hypot(at.position.north_m - 6.0, at.position.east_m + 4.0) < 1.0

    def north(start: Any, at: Any) -> bool:
        return bool(at.velocity.north_m_s > 1.5)

    def climbs(start: Any, at: Any) -> bool:
        return bool(at.velocity.down_m_s < -0.3)

    return {
        "position_ned": ("set_position_ned", (place,), at_place),
        "velocity_ned": ("set_velocity_ned", (o.VelocityNedYaw(2.0, 0.0, 0.0, 0.0),), north),
        "velocity_body": (
            "set_velocity_body",
            (o.VelocityBodyYawspeed(2.0, 0.0, 0.0, 0.0),),
            lambda start, at: math.hypot(at.velocity.north_m_s, at.velocity.east_m_s) > 1.5,
        ),
        "position_velocity_ned": (
            "set_position_velocity_ned",
            (place, o.VelocityNedYaw(0.0, 0.0, 0.0, 0.0)),
            at_place,
        ),
        "position_velocity_acceleration_ned": (
            "set_position_velocity_acceleration_ned",
            (place, o.VelocityNedYaw(0.0, 0.0, 0.0, 0.0), o.AccelerationNed(0.0, 0.0, 0.0)),
            at_place,
        ),
        "acceleration_ned": ("set_acceleration_ned", (o.AccelerationNed(1.0, 0.0, 0.0),), north),
        "attitude": ("set_attitude", (o.Attitude(0.0, 0.0, 0.0, 0.75),), climbs),
        "attitude_rate": ("set_attitude_rate", (o.AttitudeRate(0.0, 0.0, 0.0, 0.75),), climbs),
    }


SETPOINTS: Final = (
    *("position_ned", "position_global", "velocity_ned", "velocity_body", "position_velocity_ned"),
    *("position_velocity_acceleration_ned", "acceleration_ned", "attitude", "attitude_rate"),
)


@pytest.mark.parametrize("kind", SETPOINTS)
@compatibility(feature="offboard")
def test_offboard(mavsdk: Session, vehicle: str, kind: str, request: pytest.FixtureRequest) -> None:
    from mavsdk.plugins.offboard import PositionGlobalYaw

    here = fly(mavsdk)
    if kind == "position_global":
        east_deg = here.longitude_deg + 8.0 * DEG_PER_M / math.cos(math.radians(here.latitude_deg))
        place = PositionGlobalYaw(
            here.latitude_deg, east_deg, HEIGHT_M, 0.0, PositionGlobalYaw.AltitudeType.REL_HOME
        )
        method, arguments, found = "set_position_global", (place,), lambda start, at: True
    else:
        method, arguments, found = _setpoints(vehicle)[kind]
    start = mavsdk.first("telemetry", "position_velocity_ned")
    mavsdk.call("offboard", method, *arguments)
    mavsdk.call("offboard", "start")
    assert mavsdk.call("offboard", "is_active")
    if vehicle == "ardupilot" and kind == "attitude_rate":
        with pytest.raises(AssertionError, match="not seen"):
            mavsdk.first("telemetry", "position_velocity_ned", lambda at: found(start, at), wait_s=1.0)
        not_offered(request, "without attitude_rate: body rates alone are not flown in GUIDED here")
    elif kind == "position_global":
        mavsdk.first("telemetry", "position", lambda p: abs(p.longitude_deg - east_deg) < 1.5 * DEG_PER_M)
    else:
        moved(mavsdk, lambda at: found(start, at))
    mavsdk.call("offboard", "stop")
    fly(mavsdk)
