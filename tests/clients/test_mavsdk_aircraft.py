"""MAVSDK flies aircraft: its whole surface on the px4 flavour, and what it supports on ardupilot."""

import asyncio
import math
from collections.abc import Sequence
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.action import ActionError, OrbitYawBehavior
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.offboard import Attitude
from mavsdk.plugins.telemetry import FlightMode, LandedState, Position

from tests.clients.mavsdk_flying import raw_item
from tests.clients.mavsdk_waiting import WALL_DEADLINE_S, first, ground_station, transferred
from tests.clients.runway import Place, PlanItem, Runway
from tests.clients.sitl_process import free_port, running_sitl

SPEEDUP = 20.0
NAN = math.nan
AIRCRAFT = ("--model", "aerosonde")


def raw(items: Sequence[PlanItem]) -> list[Any]:
    """Items as they go over the wire."""
    plan = []
    for seq, item in enumerate(items):
        lat, lon, height_m = item.place or (0.0, 0.0, 0.0)
        plan.append(
            raw_item(
                seq, item.command, lat, lon, frame=item.frame, height_m=height_m, parameters=item.parameters
            )
        )
    return plan


class Pilot:
    """The plugins of one aircraft, and its runway."""

    def __init__(self, system: object) -> None:
        self.telemetry = TelemetryAsync(system)
        self.action = ActionAsync(system)
        self.mission = MissionAsync(system)
        self.mission_raw = MissionRawAsync(system)
        self.offboard = OffboardAsync(system)
        self.param = ParamAsync(system)
        self.runway = Runway(lat_deg=NAN, lon_deg=NAN, alt_m=NAN, heading_rad=0.0)

    async def ready(self) -> None:
        """Wait until it may be armed, and see where it is."""
        telemetry = self.telemetry
        await first(
            telemetry.subscribe_health(), lambda h: h.is_armable and h.is_global_position_ok, "armable"
        )
        here = await first(telemetry.subscribe_position(), lambda p: abs(p.latitude_deg) > 1.0, "position")
        heading = await first(telemetry.subscribe_heading(), lambda h: True, "heading")
        self.runway = Runway(
            lat_deg=here.latitude_deg,
            lon_deg=here.longitude_deg,
            alt_m=here.absolute_altitude_m,
            heading_rad=math.radians(heading.heading_deg),
        )

    async def arm(self) -> None:
        """Ask until it is armed: ArduPilot passes its checks before it has the position that a mode needs."""
        async with asyncio.timeout(WALL_DEADLINE_S):
            while True:
                try:
                    return await self.action.arm()
                except ActionError:
                    await first(self.telemetry.subscribe_position(), lambda p: True, "position")

    async def near(self, place: Place, radius_m: float, height_m: float) -> None:
        """Wait until it flies on a circle, at its height."""

        def there(position: Position) -> bool:
            at = self.runway.place(position.latitude_deg, position.longitude_deg)
            on_circle = abs(math.dist(at, place) - radius_m) < 15.0
            return on_circle and abs(position.relative_altitude_m - height_m) < 5.0

        await first(self.telemetry.subscribe_position(), there, f"circle around {place}")

    async def flies(self, mode: FlightMode) -> None:
        await first(self.telemetry.subscribe_flight_mode(), lambda m: m == mode, f"mode {mode}")

    async def lands(self) -> None:
        """Wait for the ground, and for the disarming that follows."""
        on_ground = LandedState.ON_GROUND
        await first(self.telemetry.subscribe_landed_state(), lambda s: s == on_ground, "ground")
        await first(self.telemetry.subscribe_armed(), lambda armed: not armed, "disarming")


async def take_off(pilot: Pilot) -> None:
    await pilot.action.set_takeoff_altitude(40.0)
    assert await pilot.param.get_param_float("MIS_TAKEOFF_ALT") == 40.0
    await pilot.action.arm()
    await pilot.action.takeoff()
    await pilot.flies(FlightMode.TAKEOFF)
    await first(
        pilot.telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 36.0, "take-off height"
    )
    await pilot.flies(FlightMode.HOLD)


async def go_places(pilot: Pilot) -> None:
    radius_m = await pilot.param.get_param_float("NAV_LOITER_RAD")
    alt_m = pilot.runway.alt_m
    place = pilot.runway.along(400.0, -200.0)
    lat, lon, _ = pilot.runway.geodetic(place, 0.0)
    await pilot.action.goto_location(lat, lon, alt_m + 60.0, NAN)
    await pilot.near(place, radius_m, 60.0)
    await pilot.action.goto_location_fixedwing(lat, lon, alt_m + 60.0, 180.0)
    await pilot.near(place, radius_m, 60.0)  # PX4 1.16.1 does not read the radius
    place = pilot.runway.along(300.0, 100.0)
    lat, lon, _ = pilot.runway.geodetic(place, 0.0)
    await pilot.action.do_orbit(
        140.0, 22.0, OrbitYawBehavior.HOLD_FRONT_TANGENT_TO_CIRCLE, lat, lon, alt_m + 70.0
    )
    await pilot.near(place, 140.0, 70.0)


async def fly_at_speeds(pilot: Pilot) -> None:
    await pilot.action.hold()
    await pilot.flies(FlightMode.HOLD)
    for airspeed_m_s in (21.0, 26.0):
        await pilot.action.set_current_speed(airspeed_m_s)
        await first(
            pilot.telemetry.subscribe_fixedwing_metrics(),
            lambda m, airspeed_m_s=airspeed_m_s: abs(m.airspeed_m_s - airspeed_m_s) < 0.7,
            f"airspeed of {airspeed_m_s} m/s",
        )
    metrics = await pilot.telemetry.fixedwing_metrics()
    assert metrics.throttle_percentage > 0.2
    assert abs(metrics.climb_rate_m_s) < 3.0


async def fly_attitudes(pilot: Pilot) -> None:
    offboard = pilot.offboard
    for index, roll_deg in enumerate((20.0, -30.0)):
        await offboard.set_attitude(Attitude(roll_deg, 4.0, 0.0, 0.8))
        if not index:
            await offboard.start()
            await pilot.flies(FlightMode.OFFBOARD)
        await first(
            pilot.telemetry.subscribe_attitude_euler(),
            lambda a, roll_deg=roll_deg: abs(a.roll_deg - roll_deg) < 2.0,
            f"roll of {roll_deg} deg",
        )
    await offboard.stop()
    await pilot.flies(FlightMode.HOLD)


async def fly_waypoints(pilot: Pilot) -> None:
    """Waypoints alone: PX4 asks aircraft for a landing, unless a parameter says otherwise."""
    assert await pilot.param.get_param_int("MIS_TKO_LAND_REQ") == 2
    await pilot.param.set_param_int("MIS_TKO_LAND_REQ", 0)
    places = [pilot.runway.geodetic(pilot.runway.along(*at), 60.0) for at in ((400.0, 0.0), (0.0, 200.0))]
    plan = MissionPlan(
        [
            MissionItem(
                latitude_deg=lat,
                longitude_deg=lon,
                relative_altitude_m=height_m,
                speed_m_s=24.0,
                is_fly_through=True,
            )
            for lat, lon, height_m in places
        ]
    )
    await transferred(lambda: pilot.mission.upload_mission(plan))
    assert len((await transferred(pilot.mission.download_mission)).mission_items) == len(places)
    await pilot.mission.start_mission()
    await first(
        pilot.mission.subscribe_mission_progress(), lambda p: p.total > 0 and p.current == p.total, "end"
    )


async def land_by_mission(pilot: Pilot) -> None:
    items = pilot.runway.circuit("px4")
    await transferred(lambda: pilot.mission_raw.upload_mission(raw(items)))
    assert len(await transferred(pilot.mission_raw.download_mission)) == len(items)
    await pilot.mission_raw.start_mission()
    await pilot.flies(FlightMode.MISSION)
    await first(pilot.telemetry.subscribe_landed_state(), lambda s: s == LandedState.LANDING, "landing state")
    await pilot.lands()


async def fly_px4(url: str) -> None:
    async with ground_station(url) as system:
        pilot = Pilot(system)
        await pilot.ready()
        for part in (take_off, go_places, fly_at_speeds, fly_attitudes, fly_waypoints, land_by_mission):
            await part(pilot)
        await pilot.action.arm()  # and once more, from where it has come to rest
        await pilot.action.takeoff()
        await first(
            pilot.telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 30.0, "second take-off"
        )
        await pilot.action.return_to_launch()
        await pilot.flies(FlightMode.RETURN_TO_LAUNCH)
        await pilot.action.land()
        await pilot.flies(FlightMode.LAND)
        await pilot.lands()


@pytest.mark.compatibility(
    client="MAVSDK asyncio", feature="action, offboard, mission: one flight", vehicle="px4-plane"
)
def test_px4_aircraft() -> None:
    port = free_port()
    with running_sitl("px4", [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=AIRCRAFT):
        asyncio.run(fly_px4(f"udpin://127.0.0.1:{port}"))


async def fly_arduplane(url: str) -> None:
    async with ground_station(url) as system:
        pilot = Pilot(system)
        telemetry = pilot.telemetry
        for rate in (
            telemetry.set_rate_position,
            telemetry.set_rate_landed_state,
            telemetry.set_rate_fixedwing_metrics,
            telemetry.set_rate_health,
        ):
            await rate(5.0)
        await pilot.ready()
        with pytest.raises(ActionError):  # ArduPlane has no take-off command
            await pilot.action.takeoff()
        await pilot.param.set_param_int("RTL_AUTOLAND", 3)
        items = pilot.runway.circuit("ardupilot")
        await transferred(lambda: pilot.mission_raw.upload_mission(raw(items)))
        assert len(await transferred(pilot.mission_raw.download_mission)) == len(items)
        await (
            pilot.arm()
        )  # before AUTO: MAVSDK leaves a mission for LOITER to arm, which ArduPlane doesn't do
        await pilot.mission_raw.start_mission()
        await first(telemetry.subscribe_position(), lambda p: p.relative_altitude_m > 30.0, "take-off")
        metrics = await telemetry.fixedwing_metrics()
        assert 15.0 < metrics.airspeed_m_s < 35.0
        place = pilot.runway.along(200.0, -150.0)
        lat, lon, _ = pilot.runway.geodetic(place, 0.0)
        await pilot.action.goto_location(lat, lon, pilot.runway.alt_m + 60.0, NAN)
        await pilot.near(place, await pilot.param.get_param_int("WP_LOITER_RAD"), 60.0)
        await pilot.action.return_to_launch()
        await pilot.flies(FlightMode.RETURN_TO_LAUNCH)
        await pilot.mission_raw.start_mission()
        await pilot.lands()


@pytest.mark.slow
@pytest.mark.compatibility(
    client="MAVSDK asyncio", feature="action, offboard, mission: one flight", vehicle="ardupilot-plane"
)
def test_ardupilot_aircraft() -> None:
    port = free_port()
    with running_sitl("ardupilot", [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=AIRCRAFT):
        asyncio.run(fly_arduplane(f"udpin://127.0.0.1:{port}"))
