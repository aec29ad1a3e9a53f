"""The actions of a vehicle that differ between PX4 (v1.16) and ArduPilot (4.6, copter and plane)."""

import math
from abc import ABC, abstractmethod
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import e7
from flightsim.foundation.geodesy import GeodeticPosition
from missions.kind import VehicleKind
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.telemetry import Position

PREARM: Final = "pre-arm checks"
"""Name of the autopilot's own checks in the result of `Adapter.readiness`."""


class Adapter(ABC):
    """The actions of one firmware, which have no state of their own.

    `missions.vehicle.firmware.Firmware` has the differences that are plain data.

    Args:
        commands: commands to the vehicle.
        parameters: its parameters.
    """

    def __init__(self, commands: VehicleCommands, parameters: VehicleParameters) -> None:
        self._link = commands.link
        self._commands = commands
        self._parameters = parameters

    def readiness(self) -> list[str]:
        """Names of what is still missing before the vehicle can be armed; empty when it is ready. Here: the
        messages that every firmware must have sent, and that were not received.
        """
        missing = []
        status = self._link.message(dialect.MAVLink_sys_status_message)
        if status is None or not status.onboard_control_sensors_health & dialect.MAV_SYS_STATUS_PREARM_CHECK:
            missing.append(PREARM)
        if self._link.message(dialect.MAVLink_home_position_message) is None:
            missing.append("home position")
        if self._link.message(dialect.MAVLink_global_position_int_message) is None:
            missing.append("position estimate")
        return missing

    @abstractmethod
    async def prepare_arming(self) -> None:
        """Switch to a mode in which arming is allowed."""

    @abstractmethod
    async def take_off(self, altitude_m: float) -> None:
        """Command the armed vehicle to take off."""

    @abstractmethod
    async def start_streams(self) -> None:
        """Request the telemetry that a mission needs, if the firmware doesn't send it by default."""

    @abstractmethod
    async def start_mission(self) -> None:
        """Start the uploaded mission, on the ground or in the air."""

    @abstractmethod
    async def acceptance_m(self, requested_m: float) -> float:
        """The radius within which a waypoint counts as reached."""

    @abstractmethod
    async def own_acceptance_m(self) -> float:
        """The acceptance radius of a waypoint that specifies none."""

    @abstractmethod
    async def change_altitude(self, altitude_m: float) -> None:
        """Command a height above home; the rest of the flight does not change."""

    @abstractmethod
    async def loiter(self, place: GeodeticPosition, radius_m: float | None, clockwise: bool) -> None:
        """Command a fixed wing to circle a place."""

    @abstractmethod
    async def change_airspeed(self, airspeed_m_s: float) -> None:
        """Command an airspeed to a fixed wing; the rest of the flight does not change."""

    async def _command_at(
        self,
        command: int,
        params: tuple[float, float, float, float],
        place: GeodeticPosition | Position,
        alt_m: float,
        frame: int = dialect.MAV_FRAME_GLOBAL,
    ) -> None:
        """Send a COMMAND_INT with a place and a height."""
        await self._commands.command_int(command, frame, params, e7(place.lat_deg), e7(place.lon_deg), alt_m)


_EKF_NEEDED: Final = 0x01 | 0x02 | 0x04 | 0x10 | 0x20  # attitude, velocities, absolute positions
_EKF_CONST_POS: Final = 0x80
_PLANE_RADIUS_M: Final = 255.0  # largest value of param2 of a plane's waypoint


class ArduPilot(Adapter):
    """ArduPilot: it sends nothing until requested. The plane takes off in TAKEOFF and lands only in AUTO."""

    @property
    def _plane(self) -> bool:
        return self._link.kind is VehicleKind.FIXED_WING

    def readiness(self) -> list[str]:
        missing = super().readiness()
        ekf = self._link.message(dialect.MAVLink_ekf_status_report_message)
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
        await self._command_at(
            dialect.MAV_CMD_DO_REPOSITION,
            (-1.0, 1.0, 0.0, 0.0),
            await self._link.position(),
            altitude_m,
            dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        )

    async def loiter(self, place: GeodeticPosition, radius_m: float | None, clockwise: bool) -> None:
        params = (-1.0, 1.0, radius_m or 0.0, 0.0 if clockwise else 1.0)
        await self._command_at(dialect.MAV_CMD_DO_REPOSITION, params, place, place.alt_m)

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        await self._commands.command_int(
            dialect.MAV_CMD_GUIDED_CHANGE_SPEED,
            dialect.MAV_FRAME_GLOBAL,
            (0.0, airspeed_m_s, 0.0, 0.0),
            0,
            0,
            0.0,
        )


_HERE: Final = 0x7FFFFFFF


class Px4(Adapter):
    """PX4: it streams by default, takes off by NAV_TAKEOFF, and circles by DO_ORBIT."""

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
        params = (radius_m if clockwise else -radius_m, math.nan, 0.0, math.nan)
        await self._command_at(dialect.MAV_CMD_DO_ORBIT, params, place, place.alt_m)

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        await self._commands.command(dialect.MAV_CMD_DO_CHANGE_SPEED, 0.0, airspeed_m_s, -1.0)
