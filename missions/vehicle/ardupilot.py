"""The actions of ArduPilot's copter and plane (4.6 behaviour)."""

from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind
from missions.vehicle.adapter import missing_basics
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.parameters import VehicleParameters

_EKF_NEEDED: Final = 0x01 | 0x02 | 0x04 | 0x10 | 0x20  # attitude, velocities, absolute positions
_EKF_CONST_POS: Final = 0x80
_PLANE_RADIUS_M: Final = 255.0  # largest value of param2 of a plane's waypoint


class ArduPilot:
    """ArduPilot: it sends nothing until requested. The plane takes off in TAKEOFF and lands only in AUTO.

    Args:
        commands: commands to the vehicle.
        parameters: its parameters.
    """

    def __init__(self, commands: VehicleCommands, parameters: VehicleParameters) -> None:
        self._link = commands.link
        self._commands = commands
        self._parameters = parameters

    @property
    def _plane(self) -> bool:
        return self._link.kind is VehicleKind.FIXED_WING

    def readiness(self) -> list[str]:
        missing = missing_basics(self._link)
        ekf = self._link.message("EKF_STATUS_REPORT")
        if ekf is None or ekf.flags & _EKF_NEEDED != _EKF_NEEDED or ekf.flags & _EKF_CONST_POS:
            missing.append("navigation filter on GPS")
        return missing

    async def prepare_arming(self) -> None:
        if self._link.custom_mode != self._link.firmware.modes[Mode.GUIDED]:
            await self._commands.set_mode(Mode.GUIDED)

    async def take_off(self, altitude_m: float) -> None:
        if self._plane:
            await self._parameters.write("TKOFF_ALT", altitude_m)
            await self._commands.set_mode(Mode.TAKEOFF)
            return
        await self.prepare_arming()
        await self._commands.command(dialect.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, altitude_m)

    async def start_streams(self) -> None:
        self._link.send(
            dialect.MAVLink_request_data_stream_message(
                self._link.system_id, 1, dialect.MAV_DATA_STREAM_ALL, 4, 1
            )
        )
        for name, rate_hz in self._link.firmware.stream_rates_hz.items():
            await self._commands.set_message_rate(name, rate_hz)

    async def start_mission(self) -> None:
        if self._plane:
            await self._commands.set_mode(Mode.MISSION)
            if not self._link.armed:
                await self._commands.arm()  # the takeoff roll begins with arming
            return
        if not self._link.armed:
            await self.prepare_arming()  # AUTO is not a mode for arming: arm in GUIDED
            await self._commands.arm()
        await self._commands.set_mode(Mode.MISSION)
        await self._commands.command(dialect.MAV_CMD_MISSION_START, 0.0, 0.0)

    async def acceptance_m(self, requested_m: float) -> float:
        if self._plane:
            return min(requested_m, _PLANE_RADIUS_M)
        return 0.01 * await self._parameters.read_or(
            "WPNAV_RADIUS", 100.0 * requested_m
        )  # param2 is not used

    async def own_acceptance_m(self) -> float:
        if self._plane:
            return await self._parameters.read_or("WP_RADIUS", 90.0)
        return 0.01 * await self._parameters.read_or("WPNAV_RADIUS", 200.0)

    async def change_altitude(self, altitude_m: float) -> None:
        if self._plane:
            await self._commands.command_int(
                dialect.MAV_CMD_GUIDED_CHANGE_ALTITUDE,
                dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
                (0.0, 0.0, 0.0, 0.0),
                0,
                0,
                altitude_m,
            )
            return
        position = await self._link.position()
        await self._commands.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            (-1.0, 1.0, 0.0, 0.0),
            round(position.lat_deg * 1e7),
            round(position.lon_deg * 1e7),
            altitude_m,
        )

    async def loiter(self, place: GeodeticPosition, radius_m: float | None, clockwise: bool) -> None:
        await self._commands.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, radius_m or 0.0, 0.0 if clockwise else 1.0),
            round(place.lat_deg * 1e7),
            round(place.lon_deg * 1e7),
            place.alt_m,
        )

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        await self._commands.command_int(
            dialect.MAV_CMD_GUIDED_CHANGE_SPEED,
            dialect.MAV_FRAME_GLOBAL,
            (0.0, airspeed_m_s, 0.0, 0.0),
            0,
            0,
            0.0,
        )
