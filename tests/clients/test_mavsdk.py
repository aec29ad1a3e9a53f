"""MAVSDK as a client over UDP, by its asyncio and by its synchronous interface.

The whole action, mission and offboard surface on the px4 flavour; on ardupilot what MAVSDK supports there.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from mavsdk import Configuration as SyncConfiguration
from mavsdk import Mavsdk as SyncMavsdk
from mavsdk.asyncio import ComponentType
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.offboard import Offboard, PositionNedYaw
from mavsdk.plugins.telemetry import Telemetry

from tests.clients.mavsdk_flying import raw_item
from tests.clients.mavsdk_waiting import WALL_DEADLINE_S, first, ground_station, transfer, transferred
from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow

SPEEDUP = 10.0


def mission_items(latitude_deg: float, longitude_deg: float) -> list[MissionItem]:
    """A triangle of 30 m at 12 m height."""
    corners = ((3e-4, 0.0), (3e-4, 3e-4), (0.0, 0.0))
    return [
        MissionItem(
            latitude_deg=latitude_deg + north,
            longitude_deg=longitude_deg + east,
            relative_altitude_m=12.0,
            speed_m_s=5.0,
            is_fly_through=True,
        )
        for north, east in corners
    ]


def raw_items(latitude_deg: float, longitude_deg: float) -> list[Any]:
    """Home, a take-off and two waypoints, as they go over the wire."""
    corners = ((0, 16, 0.0, 0.0), (6, 22, 0.0, 0.0), (6, 16, 2e-4, 0.0), (6, 16, 2e-4, 2e-4))
    return [
        raw_item(seq, command, latitude_deg + north, longitude_deg + east, frame=frame)
        for seq, (frame, command, north, east) in enumerate(corners)
    ]


async def fly_px4(url: str) -> None:
    async with ground_station(url) as system:
        telemetry, action = TelemetryAsync(system), ActionAsync(system)
        await first(telemetry.subscribe_health_all_ok(), bool, "health")
        await first(telemetry.subscribe_health(), lambda health: health.is_armable, "armable")

        await action.set_takeoff_altitude(10.0)
        await action.arm()
        await action.takeoff()
        here = await first(
            telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 9.0, "takeoff height"
        )
        await action.goto_location(
            here.latitude_deg + 2e-4, here.longitude_deg, here.absolute_altitude_m + 2.0, float("nan")
        )
        await first(
            telemetry.subscribe_position(),
            lambda p: abs(p.latitude_deg - here.latitude_deg - 2e-4) < 1e-5,
            "goto",
        )

        offboard = OffboardAsync(system)
        await offboard.set_position_ned(PositionNedYaw(0.0, 10.0, -12.0, 90.0))
        await offboard.start()
        assert await offboard.is_active()
        await first(
            telemetry.subscribe_position_velocity_ned(),
            lambda p: abs(p.position.north_m) < 1.0 and abs(p.position.east_m - 10.0) < 1.0,
            "offboard position",
        )
        await offboard.stop()

        mission = MissionAsync(system)
        plan = MissionPlan(mission_items(here.latitude_deg, here.longitude_deg))
        await transferred(lambda: mission.upload_mission(plan))
        assert len((await transferred(mission.download_mission)).mission_items) == len(plan.mission_items)
        await mission.start_mission()
        await first(
            mission.subscribe_mission_progress(),
            lambda p: p.total > 0 and p.current == p.total,
            "mission end",
        )
        await action.hold()
        await action.return_to_launch()
        await first(telemetry.subscribe_in_air(), lambda in_air: not in_air, "landing")
        await first(telemetry.subscribe_armed(), lambda armed: not armed, "disarm")


@pytest.mark.compatibility(
    client="MAVSDK asyncio", feature="action, offboard, mission: one flight", vehicle="px4"
)
def test_asyncio_interface_flies_px4() -> None:
    port = free_port()
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP):
        asyncio.run(fly_px4(f"udpin://127.0.0.1:{port}"))


def until(what: str, found: Callable[[], bool]) -> None:
    """Poll a condition; the synchronous interface has no other way to wait."""
    deadline_s = time.monotonic() + WALL_DEADLINE_S
    while not found():
        assert time.monotonic() < deadline_s, f"{what} was not seen"
        time.sleep(0.02)


def accepted(action: Callable[[], None]) -> bool:
    """Ask for an action; False when the vehicle says that it can't be done (now)."""
    try:
        action()
    except ActionError:
        return False
    return True


@pytest.mark.parametrize("flavour", [slow("px4"), "ardupilot"])
@pytest.mark.compatibility(
    client="MAVSDK synchronous", feature="action, offboard, mission: one flight", parameter="flavour"
)
def test_synchronous_interface_flies(flavour: str) -> None:
    port = free_port()
    with running_sitl(flavour, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP):
        configuration = SyncConfiguration.create_with_component_type(ComponentType.GROUND_STATION)
        with SyncMavsdk(configuration) as mavsdk:
            mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
            system = mavsdk.first_autopilot(timeout_s=100.0)
            assert system is not None
            telemetry, action = Telemetry(system), Action(system)
            if flavour == "ardupilot":
                telemetry.set_rate_position(10.0)
                telemetry.set_rate_position_velocity_ned(10.0)
                telemetry.set_rate_in_air(5.0)
                telemetry.set_rate_health(2.0)
            until(
                "armable", lambda: telemetry.health().is_armable and telemetry.health().is_global_position_ok
            )
            action.set_takeoff_altitude(8.0)
            until("arming", lambda: accepted(action.arm))  # ArduPilot is armable before it has a position
            action.takeoff()
            until("height", lambda: telemetry.position().relative_altitude_m > 7.0)
            here = telemetry.position()
            action.goto_location(
                here.latitude_deg, here.longitude_deg + 2e-4, here.absolute_altitude_m, float("nan")
            )
            until(
                "goto", lambda: abs(telemetry.position().longitude_deg - here.longitude_deg - 2e-4) < 1.5e-5
            )
            offboard = Offboard(system)
            offboard.set_position_ned(PositionNedYaw(8.0, 0.0, -10.0, 0.0))
            offboard.start()
            until("offboard", lambda: abs(telemetry.position_velocity_ned().position.north_m - 8.0) < 1.0)
            offboard.stop()
            if flavour == "px4":
                mission = Mission(system)
                plan = MissionPlan(mission_items(here.latitude_deg, here.longitude_deg))
                transfer(lambda: mission.upload_mission(plan))
                mission.start_mission()
                until("mission end", mission.is_mission_finished)
            else:
                raw = MissionRaw(system)  # the plain mission interface can't read ArduPilot's home item back
                items = raw_items(here.latitude_deg, here.longitude_deg)
                transfer(lambda: raw.upload_mission(items))
                assert len(transfer(raw.download_mission)) == 4
                raw.start_mission()
                until("mission end", lambda: raw.mission_progress().current == 3)
            action.return_to_launch()
            until("descent", lambda: telemetry.position().relative_altitude_m < 2.0)
            action.land()
            until("disarm", lambda: not telemetry.armed())
