"""Scripts as MAVSDK's users write them from its examples: they wait for what the vehicle announces, then act.

They start with the SITL, without a pause before arming, and take no refusal for an answer.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.offboard import Attitude, VelocityNedYaw

from tests.clients.mavsdk_waiting import first, ground_station
from tests.clients.sitl_process import free_port, running_sitl

Script = Callable[[Any], Awaitable[None]]


async def _when_ready(system: Any) -> tuple[TelemetryAsync, ActionAsync]:
    """All that the examples wait for before they arm."""
    telemetry, action = TelemetryAsync(system), ActionAsync(system)
    await first(
        telemetry.subscribe_health(),
        lambda health: health.is_global_position_ok and health.is_home_position_ok,
        "global position and home",
    )
    await action.arm()
    return telemetry, action


async def takeoff_and_land(system: Any) -> None:
    telemetry, action = await _when_ready(system)
    await action.takeoff()
    await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 2.0, "height")
    await action.land()
    await first(telemetry.subscribe_in_air(), lambda in_air: not in_air, "landing")


async def offboard_velocity(system: Any) -> None:
    telemetry, action = await _when_ready(system)
    offboard = OffboardAsync(system)
    await offboard.set_velocity_ned(VelocityNedYaw(0.0, 0.0, 0.0, 0.0))
    await offboard.start()
    await offboard.set_velocity_ned(VelocityNedYaw(0.0, 0.0, -2.0, 0.0))
    await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 4.0, "height")
    await offboard.set_velocity_ned(VelocityNedYaw(2.0, 0.0, 0.0, 180.0))
    await first(
        telemetry.subscribe_position_velocity_ned(), lambda p: p.velocity.north_m_s > 1.5, "velocity north"
    )
    await offboard.stop()
    await action.land()


async def offboard_attitude(system: Any) -> None:
    telemetry, action = await _when_ready(system)
    offboard = OffboardAsync(system)
    await offboard.set_attitude(Attitude(0.0, 0.0, 0.0, 0.0))
    await offboard.start()
    await offboard.set_attitude(Attitude(0.0, 0.0, 0.0, 0.7))
    await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 2.0, "height")
    await offboard.set_attitude(Attitude(10.0, 0.0, 0.0, 0.6))
    await first(telemetry.subscribe_attitude_euler(), lambda a: a.roll_deg > 7.0, "roll")
    await offboard.stop()
    await action.land()


@pytest.mark.slow
@pytest.mark.parametrize(
    "script", [takeoff_and_land, offboard_velocity, offboard_attitude], ids=lambda script: script.__name__
)
def test_examples_fly_as_they_are(script: Script) -> None:
    port = free_port()

    async def fly() -> None:
        async with ground_station(f"udpin://127.0.0.1:{port}") as system:
            await script(system)

    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=1.0):
        asyncio.run(fly())
