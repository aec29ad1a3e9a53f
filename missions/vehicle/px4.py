"""The actions of PX4 (v1.16 behaviour), for multicopters and fixed wings."""

import math
from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind
from missions.vehicle.adapter import missing_basics
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.parameters import VehicleParameters

_HERE: Final = 0x7FFFFFFF


class Px4:
    """PX4: it streams by default, takes off by NAV_TAKEOFF, and circles by DO_ORBIT.

    Args:
        commands: commands to the vehicle.
        parameters: its parameters.
    """

    def __init__(self, commands: VehicleCommands, parameters: VehicleParameters) -> None:
        self._link = commands.link
        self._commands = commands
        self._parameters = parameters

    def readiness(self) -> list[str]:
        return missing_basics(self._link)

    async def prepare_arming(self) -> None:
        modes = self._link.firmware.modes
        if self._link.custom_mode not in (modes[Mode.HOLD], modes[Mode.MISSION]):
            await self._commands.set_mode(Mode.HOLD)

    async def take_off(self, altitude_m: float) -> None:
        nan = math.nan
        height_amsl = self._link.home.alt_m + altitude_m
        await self._commands.command(dialect.MAV_CMD_NAV_TAKEOFF, -1.0, nan, nan, nan, nan, nan, height_amsl)

    async def start_streams(self) -> None:
        """Request only the messages that are missing in the link's set, because PX4 streams by default."""
        await self._link.clock.sleep(1.2)
        for name, rate_hz in self._link.firmware.stream_rates_hz.items():
            if self._link.message(name) is None:
                await self._commands.set_message_rate(name, rate_hz)

    async def start_mission(self) -> None:
        # the uploaded mission becomes available shortly after its acknowledgement: set_mode tries again
        await self._commands.set_mode(Mode.MISSION)
        if not self._link.armed:
            await self.prepare_arming()
            await self._commands.arm()

    async def acceptance_m(self, requested_m: float) -> float:
        if self._link.kind is VehicleKind.MULTICOPTER:
            return requested_m  # a waypoint's param2 is used
        return max(requested_m, await self.own_acceptance_m())

    async def own_acceptance_m(self) -> float:
        return await self._parameters.read_or("NAV_ACC_RAD", 10.0)

    async def change_altitude(self, altitude_m: float) -> None:
        # INT32_MAX as latitude and longitude means the present place
        await self._commands.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, math.nan, math.nan),
            _HERE,
            _HERE,
            self._link.home.alt_m + altitude_m,
        )

    async def loiter(self, place: GeodeticPosition, radius_m: float | None, clockwise: bool) -> None:
        if radius_m is None:
            radius_m = abs(await self._parameters.read_or("NAV_LOITER_RAD", 80.0))
        # PX4 1.16.1 ignores the radius of DO_REPOSITION: it circles clockwise with NAV_LOITER_RAD.
        # DO_ORBIT takes a signed radius, and an aircraft stays in Hold with it
        await self._commands.command_int(
            dialect.MAV_CMD_DO_ORBIT,
            dialect.MAV_FRAME_GLOBAL,
            (radius_m if clockwise else -radius_m, math.nan, 0.0, math.nan),
            round(place.lat_deg * 1e7),
            round(place.lon_deg * 1e7),
            place.alt_m,
        )

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        await self._commands.command(dialect.MAV_CMD_DO_CHANGE_SPEED, 0.0, airspeed_m_s, -1.0)
