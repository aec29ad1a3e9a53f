"""What only fixed wings do: circles, flight by headings and rolls, and landing along an approach."""

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError, PlanError
from missions.vehicle.adapters import Adapter
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.heading_flight import HeadingFlight, open_heading_flight
from missions.vehicle.mission_transfer import upload
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.plans import VehiclePlans
from missions.vehicle.telemetry import Attitude, Position

_GLIDE_SLOPE_RAD: Final = math.radians(3.5)  # PX4 refuses more than FW_LND_ANG, 5 deg
_APPROACH_HEIGHT_M: Final = 40.0
_TAIL_WIND_M_S: Final = 1.0
_FARTHEST_M: Final = 10_000.0
_GROUND_FRAME: Final = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT


@dataclass(frozen=True, slots=True, kw_only=True)
class Approach:
    """The landing approach of an aircraft: a circle for the descent, and a straight line from it to the
    ground.

    Attributes:
        place: place of the touch-down.
        heading_rad: direction of the landing, clockwise from north.
        height_m: height above home at the end of the circle.
        circle_radius_m: radius of the circle, clockwise positive.
    """

    place: GeodeticPosition
    heading_rad: float
    height_m: float = _APPROACH_HEIGHT_M
    circle_radius_m: float = 100.0

    def __post_init__(self) -> None:
        if not self.height_m >= 10.0:
            raise PlanError(f"an approach from {self.height_m:g} m is too low; ask for 10 m or more")
        if not abs(self.circle_radius_m) >= 20.0:
            raise PlanError(
                f"an approach circle of {self.circle_radius_m:g} m is too tight; ask for 20 m or more"
            )

    @property
    def length_m(self) -> float:
        """Length of the straight part, over ground."""
        return self.height_m / math.tan(_GLIDE_SLOPE_RAD)

    def items(self) -> list[MissionItem]:
        """The items of the circle, which is left along the line of the landing, and of the landing."""
        frame = LocalFrame(self.place)
        north, east = math.cos(self.heading_rad), math.sin(self.heading_rad)
        # the circle touches the line where the descent begins; its centre is abeam of that point
        back, side = -self.length_m, self.circle_radius_m
        lat, lon, _ = frame.geodetic_from_ned(back * north - side * east, back * east + side * north, 0.0)
        return [
            MissionItem(
                command=dialect.MAV_CMD_NAV_LOITER_TO_ALT,
                frame=_GROUND_FRAME,
                param1=1.0,  # leave the circle only in the direction of the next item
                param2=self.circle_radius_m,
                param4=1.0,  # the line to the next item begins where the circle is left
                x=lat,
                y=lon,
                z=self.height_m,
            ),
            MissionItem(
                command=dialect.MAV_CMD_NAV_LAND,
                frame=_GROUND_FRAME,
                x=self.place.lat_deg,
                y=self.place.lon_deg,
                z=0.0,
            ),
        ]


class FixedWing:
    """The functions of a fixed wing that a multicopter does not have; see `Vehicle.wing`.

    Args:
        commands: commands to the aircraft.
        adapter: its firmware's actions.
        parameters: its parameters.
        plans: its plans.

    Attributes:
        runway_heading_rad: heading on the ground before the last takeoff: along the runway. None: not known.
        pilot: flies the aircraft by attitude; None before `prepare_piloting`.
    """

    def __init__(
        self, commands: VehicleCommands, adapter: Adapter, parameters: VehicleParameters, plans: VehiclePlans
    ) -> None:
        self.runway_heading_rad: float | None = None
        self.pilot: AttitudePilot | None = None
        self._link = commands.link
        self._commands = commands
        self._adapter = adapter
        self._parameters = parameters
        self._plans = plans

    def note_runway(self) -> None:
        """Store the heading of the aircraft on the ground; it will land in that direction or the opposite
        one.
        """
        attitude = self._link.latest(Attitude)
        if attitude is not None and not self._link.armed:
            self.runway_heading_rad = attitude.yaw_rad

    async def prepare_piloting(self) -> AttitudePilot:
        """On the ground: prepare for flight by headings or rolls; heights are relative to this place."""
        if self.pilot is not None:
            self.pilot.close()
        self.pilot = await AttitudePilot.on_ground(self._commands, self._adapter, self._parameters)
        return self.pilot

    # circles and airspeed

    async def loiter(
        self,
        place: GeodeticPosition | None = None,
        *,
        radius_m: float | None = None,
        clockwise: bool = True,
        wait: bool = True,
        timeout_s: float | None = None,
    ) -> None:
        """Fly to a place and circle it.

        Args:
            place: centre, and altitude above mean sea level; None: the present position.
            radius_m: radius; None: the autopilot's default.
            clockwise: direction, seen from above.
            wait: whether to wait until it circles there, near the altitude.

        Raises:
            PlanError: the radius is not possible, or the place is too far away, or below home, which is not
                allowed (`Vehicle.allow_below_home`); nothing was sent.
        """
        if radius_m is not None and not (math.isfinite(radius_m) and radius_m > 0.0):
            raise PlanError(f"a circle of radius {radius_m:g} m can't be flown; ask for more than 0 m")
        here = await self._link.position()
        if place is None:
            place = GeodeticPosition(lat_deg=here.lat_deg, lon_deg=here.lon_deg, alt_m=here.alt_m)
        frame = LocalFrame(place)
        away_m = math.hypot(*frame.ned_from_geodetic(here.lat_deg, here.lon_deg, here.alt_m)[:2])
        if not away_m <= _FARTHEST_M:
            raise PlanError(
                f"the place {place} is {away_m * 1e-3:.1f} km away; accepted: at most "
                f"{_FARTHEST_M * 1e-3:g} km"
            )
        self._commands.heights.check(place.alt_m - self._link.home.alt_m, "loiter")
        await self._adapter.loiter(place, radius_m, clockwise)
        if not wait:
            return
        near_m = 1.5 * (radius_m or 120.0) + 20.0

        def there() -> bool:
            self._link.require_armed("on its way")
            p = self._link.latest(Position)
            if p is None:
                return False
            north, east, down = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
            return math.hypot(north, east) < near_m and abs(down) < 10.0

        await self._link.wait_until(
            there,
            what="arrival at the circle",
            on=("GLOBAL_POSITION_INT",),
            timeout_s=timeout_s or 120.0 + 0.2 * away_m,
        )

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        """Change the airspeed."""
        await self._adapter.change_airspeed(airspeed_m_s)

    # headings and rolls

    @asynccontextmanager
    async def heading_flight(
        self, *, altitude_m: float, airspeed_m_s: float | None = None
    ) -> AsyncIterator[HeadingFlight]:
        """Fly headings: `async with vehicle.wing.heading_flight(altitude_m=100) as flight`, then
        `await flight.turn_to(1.57)`.

        Altitude and airspeed are held; `prepare_piloting` must have been called on the ground. ArduPilot's
        plane receives commands (GUIDED_CHANGE_HEADING), PX4 a stream of attitude setpoints that hold the
        heading. At the end the vehicle holds its position.

        Args:
            altitude_m: height above home.
            airspeed_m_s: airspeed; None: the autopilot's default.
        """
        if self.pilot is None:
            raise PlanError("call `await vehicle.wing.prepare_piloting()` on the ground, before takeoff")
        self._commands.heights.check(altitude_m, "heading_flight")
        async with open_heading_flight(
            self._commands, self._adapter, self._parameters, self.pilot, altitude_m, airspeed_m_s
        ) as flight:
            yield flight

    # coming down

    def landing_heading_rad(self) -> float:
        """Direction of the landing: that of the takeoff, or the opposite one when the wind has turned.

        Raises:
            MissionError: neither runway nor heading is known.
        """
        heading = self.runway_heading_rad
        if heading is None:
            attitude = self._link.latest(Attitude)
            if attitude is None:
                raise MissionError(f"no direction to land in is known; {self._link.last_received()}")
            heading = attitude.yaw_rad
        wind = self.wind_ne_m_s()
        if wind is not None and wind[0] * math.cos(heading) + wind[1] * math.sin(heading) > _TAIL_WIND_M_S:
            heading += math.pi
        return math.remainder(heading, math.tau)

    def wind_ne_m_s(self) -> tuple[float, float] | None:
        """The autopilot's estimate of the velocity of the air (WIND_COV or WIND), north and east; None: not
        reported.
        """
        m = self._link.message(dialect.MAVLink_wind_cov_message)
        if m is not None and math.isfinite(m.wind_x) and math.isfinite(m.wind_y):
            return float(m.wind_x), float(m.wind_y)
        wind = self._link.message(dialect.MAVLink_wind_message)
        if wind is not None and math.isfinite(wind.speed) and math.isfinite(wind.direction):
            source = math.radians(wind.direction)
            return -wind.speed * math.cos(source), -wind.speed * math.sin(source)
        return None

    async def land_along(
        self, approach: Approach | None = None, *, wait: bool = True, timeout_s: float = 900.0
    ) -> None:
        """Upload an approach in place of the vehicle's mission, and fly it to land.

        Args:
            approach: the approach; None: at home, along the runway.
            wait: whether to wait until the vehicle is disarmed.
        """
        if approach is None:
            approach = Approach(place=self._link.home, heading_rad=self.landing_heading_rad())
        own = items = approach.items()
        if self._link.firmware.first_mission_item_is_home:
            items = [MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, frame=0, x=approach.place.lat_deg,
                                 y=approach.place.lon_deg, z=approach.place.alt_m), *own]  # fmt: skip
        await upload(self._link, items)
        await self._plans.rewind_mission()
        self._plans.note_stored(own, len(items) - len(own))
        await self._commands.set_mode(Mode.MISSION)
        if wait:
            await self._link.wait_disarmed(timeout_s)
