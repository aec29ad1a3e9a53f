"""The interface of missions to a vehicle."""

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Final, TypeVar

from autopilot_bridge.clock import Clock
from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError, PlanError
from missions.kind import VehicleKind
from missions.vehicle.adapters import Adapter, ArduPilot, Px4
from missions.vehicle.commands import ACK_S, VehicleCommands
from missions.vehicle.connection import Connection
from missions.vehicle.firmware import Firmware, Mode
from missions.vehicle.guided import GuidedSession, LocalOrigin, SetpointSource, guided_session
from missions.vehicle.limits import FORECAST_WIND_M_S, FixedWingLimits, Limits
from missions.vehicle.link import VehicleLink
from missions.vehicle.notes import FlightNotes
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.payload import Payload
from missions.vehicle.plans import VehiclePlans
from missions.vehicle.point_flight import PointFlight
from missions.vehicle.readiness import Readiness
from missions.vehicle.returning import ReturnEnd
from missions.vehicle.safe_exit import SafeExit
from missions.vehicle.sensors import SensorWatch
from missions.vehicle.telemetry import Position
from missions.vehicle.wing import FixedWing

T = TypeVar("T")


_ADAPTERS: Final[Mapping[str, Callable[[VehicleCommands, VehicleParameters], Adapter]]] = {
    "px4": Px4,
    "ardupilot": ArduPilot,
}


class Vehicle:
    """A vehicle over MAVLink, PX4 or ArduPilot; its heartbeat identifies the firmware.

    All times are the vehicle's. Every wait has a deadline; a `VehicleTimeout` names what was awaited and what
    was received. Heights are above home; local positions are NED metres from home.

    Args:
        connection: a started connection.
        system_id: system id of the vehicle; None: the first autopilot received.

    Attributes:
        link: its messages: identity, newest values, streams, and waits.
        commands: the command protocol, modes, and message rates.
        parameters: its stored parameters.
        plans: its stored mission, geofence and rally points, and the progress of the mission.
        payload: camera, gimbal and survey magnetometer.
        return_end: whether its returns end on the ground, and the wait for their end.
        safe_exit: leaves it safe, and says how it was left.
        sensors: the sensors that the present mission needs, and whether they work.
        local_origin: origin of the autopilot's local frame.
        forecast_wind_m_s: wind that turns are planned for: the user's forecast, not the measured wind.
    """

    def __init__(self, connection: Connection, system_id: int | None = None) -> None:
        self.link = VehicleLink(connection, system_id)
        self.commands = VehicleCommands(self.link)
        self.parameters = VehicleParameters(self.link)
        self.plans = VehiclePlans(self.link, self.parameters, self.commands.heights)
        self.payload = Payload(self.link)
        self.return_end = ReturnEnd(self.link, self.parameters)
        self.safe_exit = SafeExit(self.link, self.commands)
        self.sensors = SensorWatch(self.link)
        self.forecast_wind_m_s: float = FORECAST_WIND_M_S
        self.local_origin = LocalOrigin(self.commands)
        self._adapter: Adapter | None = None
        self._wing: FixedWing | None = None
        self._resuming: asyncio.Task[None] | None = None
        self.link.on_regained = self._resume_streams

    # parts that depend on the firmware and on the class of vehicle

    @property
    def adapter(self) -> Adapter:
        """The actions of the vehicle's firmware, known from its first heartbeat on."""
        if self._adapter is None:
            self._adapter = _ADAPTERS[self.autopilot](self.commands, self.parameters)
        return self._adapter

    @property
    def wing(self) -> FixedWing:
        """What only fixed wings do: circles, flight by headings and rolls, landing along an approach.

        Raises:
            PlanError: the vehicle is a multicopter.
        """
        if self.kind is not VehicleKind.FIXED_WING:
            raise PlanError(
                f"circles, heading flight and landing approaches are for aircraft with wings; "
                f"this is a {self.kind}"
            )
        if self._wing is None:
            self._wing = FixedWing(self.commands, self.adapter, self.parameters, self.plans)
        return self._wing

    # newest values

    @property
    def clock(self) -> Clock:
        """Vehicle time."""
        return self.link.clock

    @property
    def notes(self) -> FlightNotes:
        """The mission's record of its phases, its progress and its commands, for the run's summary."""
        return self.link.notes

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id, known from its first heartbeat on."""
        return self.link.system_id

    @property
    def firmware(self) -> Firmware:
        """The conventions of the vehicle's firmware, known from its first heartbeat on."""
        return self.link.firmware

    @property
    def autopilot(self) -> str:
        """Firmware: "px4" or "ardupilot"."""
        return self.firmware.name

    @property
    def kind(self) -> VehicleKind:
        """Class of vehicle: multicopter or fixed wing."""
        return self.link.kind

    @property
    def armed(self) -> bool:
        """Whether the vehicle is armed; see `VehicleLink.armed`."""
        return self.link.armed

    @property
    def mode(self) -> str:
        """Flight mode of the newest heartbeat, with the firmware's name."""
        return self.link.mode

    @property
    def home(self) -> GeodeticPosition:
        """Home as reported by the vehicle. In flight it stays the place from before the take-off, from which
        heights and local positions are measured; a return may lead to another one, set since.
        """
        return self.link.home

    @property
    def allow_below_home(self) -> bool:
        """Whether heights below home may be commanded: where the ground is lower. They are refused by
        default.
        """
        return self.commands.heights.below_home_allowed

    @allow_below_home.setter
    def allow_below_home(self, allowed: bool) -> None:
        self.commands.heights.below_home_allowed = allowed

    def latest(self, kind: type[T]) -> T | None:
        """Newest telemetry of a kind, for example `latest(Position)`; see `VehicleLink.latest`."""
        return self.link.latest(kind)

    async def position(self, timeout_s: float = 5.0) -> Position:
        """Newest global position; waits for one when there is none yet."""
        return await self.link.position(timeout_s)

    def telemetry(self, kind: type[T]) -> AsyncIterator[T]:
        """Stream of telemetry: `async for position in vehicle.telemetry(Position)`."""
        return self.link.telemetry(kind)

    # start

    async def wait_heartbeat(self, timeout_s: float = 15.0) -> None:
        """Wait for a heartbeat of an autopilot; from then on its firmware and system id are known."""
        await self.link.wait_until(
            lambda: self.link.identified,
            what="heartbeat of a PX4 or ArduPilot autopilot",
            on=("HEARTBEAT",),
            timeout_s=timeout_s,
        )

    async def wait_ready(self, timeout_s: float = 90.0, *, leave_mode: bool = True) -> None:
        """Wait until the vehicle could be armed: pre-arm checks, home, navigation.

        Args:
            timeout_s: time limit of each of its waits.
            leave_mode: whether a vehicle that stands disarmed in the mode of its last flight (a mission, a
                return, a landing) is switched to another mode. In that mode the checks may fail: PX4 is not
                armed in Return or Land, and ArduPilot's plane waits for another mode or mission after a
                landing.
        """
        await self.wait_heartbeat(timeout_s)
        await Readiness(self.commands, self.adapter, self.plans).wait(timeout_s, leave_mode=leave_mode)

    async def limits(self, altitude_m: float = 0.0) -> Limits:
        """The limits for a planner, from the vehicle's parameters.

        Args:
            altitude_m: height of the flight above home. An aircraft turns wider in thin air, and in the wind
                of `forecast_wind_m_s`.
        """
        limits = await self.parameters.limits()
        if not isinstance(limits, FixedWingLimits):
            return limits
        home = self.link.home_or_none()
        return replace(
            limits,
            wind_m_s=self.forecast_wind_m_s,
            air_altitude_m=altitude_m + (0.0 if home is None else home.alt_m),
        )

    async def parameter(self, name: str) -> float:
        """Read a parameter."""
        return await self.parameters.read(name)

    async def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter and wait for the confirmation."""
        await self.parameters.write(name, value)

    async def set_parameters(self, values: Mapping[str, float]) -> None:
        """Set several parameters in order."""
        await self.parameters.write_all(values)

    async def command(self, command: int, *params: float, timeout_s: float = ACK_S) -> None:
        """Send a COMMAND_LONG repeatedly until it is answered; see `VehicleCommands.command`."""
        await self.commands.command(command, *params, timeout_s=timeout_s)

    async def try_command(self, command: int, *params: float, timeout_s: float = ACK_S) -> int:
        """As `command`, but returns the MAV_RESULT."""
        return await self.commands.try_command(command, *params, timeout_s=timeout_s)

    # flying

    async def arm(self, timeout_s: float = 15.0) -> None:
        """Arm and wait for it in a heartbeat; after a temporary refusal it tries again until the deadline."""
        await self.adapter.prepare_arming()
        await self.commands.arm(timeout_s)

    async def wait_armed(self, timeout_s: float = 300.0) -> None:
        """Wait until a pilot or another ground station arms the vehicle, and command it afterwards. Without
        this wait a vehicle that another one arms is left to them.
        """
        self.link.authority.others_may_arm = True
        await self.link.wait_until(
            lambda: self.armed, what="armed heartbeat", on=("HEARTBEAT",), timeout_s=timeout_s
        )

    async def disarm(self) -> None:
        """Disarm and wait for it in a heartbeat. In the air the vehicle refuses it."""
        await self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
        await self.link.wait_disarmed(5.0)

    async def takeoff(self, altitude_m: float, timeout_s: float | None = None) -> None:
        """Arm if needed, take off, and wait until the height above home is reached and held.

        Raises:
            PlanError: the altitude is not finite and above 0; nothing was sent.
        """
        if not (math.isfinite(altitude_m) and altitude_m > 0.0):
            raise PlanError(
                f"takeoff to {altitude_m:g} m is not possible; accepted: a finite altitude above 0 m "
                "(altitude above home, positive up)"
            )
        wings = self.kind is VehicleKind.FIXED_WING
        if wings:
            self.wing.note_runway()
        if self.firmware.altitude_radius is not None:
            # so that the mode after the take-off is not taken for a pilot's
            radius_m = await self.parameters.read_or(*self.firmware.altitude_radius)
            low = altitude_m < radius_m  # PX4 1.16.1, mission_block.cpp: is_mission_item_reached_or_completed
            self.link.tasks.altitude_radius_m = 0.5 * altitude_m if low else radius_m
        if not self.armed:
            await self.arm()
        await self.adapter.take_off(altitude_m)
        slack_m, level_m_s = (
            (max(3.0, 0.05 * altitude_m), 2.0) if wings else (max(0.5, 0.05 * altitude_m), 0.4)
        )

        def reached() -> bool:
            position = self.latest(Position)
            self.link.require_armed("during takeoff")
            return (
                position is not None
                and position.height_m > altitude_m - slack_m
                and abs(position.vel_ned_m_s[2]) < level_m_s
            )

        await self.link.wait_until(
            reached,
            what=f"takeoff to {altitude_m:g} m",
            on=("GLOBAL_POSITION_INT",),
            timeout_s=timeout_s or 20.0 + 2.0 * altitude_m,
        )

    async def hold(self) -> None:
        """Stop and hold position, in a mode that needs no pilot and no setpoints."""
        await self.commands.set_mode(Mode.HOLD)

    async def goto(
        self, target: GeodeticPosition, *, tolerance_m: float = 1.0, timeout_s: float | None = None
    ) -> None:
        """Fly straight to a point (DO_REPOSITION) and wait until the vehicle is there and slow.

        For multicopters only, because a fixed wing can't be slow; see `wing.loiter` for those.

        Raises:
            PlanError: the target is more than 10 km from home, or below home, which is not allowed
                (`allow_below_home`); nothing was sent.
            MissionError: the vehicle disarmed, or changed to a mode that this mission did not command (a
                failsafe, a pilot).
        """
        if self.kind is VehicleKind.FIXED_WING:
            raise PlanError("an aircraft with wings can't stop at a point: use wing.loiter")
        await PointFlight(self.commands, target).fly(tolerance_m, timeout_s)

    async def goto_ned(
        self, north_m: float, east_m: float, down_m: float, *, tolerance_m: float = 1.0
    ) -> None:
        """`goto` to a point in NED from home."""
        lat, lon, alt = LocalFrame(self.home).geodetic_from_ned(north_m, east_m, down_m)
        await self.goto(GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt), tolerance_m=tolerance_m)

    async def change_altitude(self, altitude_m: float) -> None:
        """Change the height above home.

        Raises:
            PlanError: it is below home, which is not allowed (`allow_below_home`); nothing was sent.
        """
        self.commands.heights.check(altitude_m, "change_altitude")
        await self.adapter.change_altitude(altitude_m)

    async def set_speed(self, speed_m_s: float) -> None:
        """Command the ground speed for missions, goto and return (DO_CHANGE_SPEED)."""
        await self.command(dialect.MAV_CMD_DO_CHANGE_SPEED, 1.0, speed_m_s, -1.0)

    @asynccontextmanager
    async def guided(self, rate_hz: float = 25.0) -> AsyncIterator[GuidedSession]:
        """Fly by streamed setpoints: `async with vehicle.guided() as g: await g.follow(source)`.

        PX4 receives setpoints before and continuously in OFFBOARD; between two calls of `follow` the last one
        is repeated. At the end the vehicle holds its position.
        """
        async with guided_session(self.commands, rate_hz, await self.local_origin.from_home()) as session:
            yield session

    async def follow(self, source: SetpointSource, rate_hz: float = 25.0) -> None:
        """Follow streamed setpoints until the source ends, then hold.

        Args:
            source: called with vehicle seconds since the first setpoint was due; returns a `Setpoint` in NED
                from home, or None at the end.
            rate_hz: setpoints per vehicle second; PX4 needs more than 2.
        """
        async with self.guided(rate_hz) as session:
            await session.follow(source)

    async def start_mission(self) -> None:
        """Start the uploaded mission; on the ground it arms and takes off."""
        await self.adapter.start_mission()

    async def return_to_launch(self, *, wait: bool = True, timeout_s: float = 600.0) -> None:
        """Return and (with `wait`) wait for its end: until the vehicle is disarmed or, if its parameters keep
        it in the air (ArduPlane's RTL_AUTOLAND 0), until it circles or hovers over home. The notes then have
        `aloft`.
        """
        await self.commands.set_mode(Mode.RETURN)
        if wait:
            await self.return_end.wait(timeout_s)

    async def land(self, *, wait: bool = True, timeout_s: float = 300.0) -> None:
        """Land here and (with `wait`) wait until the vehicle is disarmed."""
        await self.commands.set_mode(Mode.LAND)
        if wait:
            await self.link.wait_disarmed(timeout_s)

    # safety

    def _resume_streams(self) -> None:
        if self._resuming is None or self._resuming.done():
            self._resuming = asyncio.get_running_loop().create_task(self._request_streams_again())

    async def _request_streams_again(self) -> None:
        """Request the streams again, because a link that was lost may have restarted with its own streams."""
        with suppress(MissionError):
            await self.adapter.start_streams()
            await self.commands.request_rates_again()

    @asynccontextmanager
    async def safe_on_exit(self, action: Mode = Mode.RETURN) -> AsyncIterator["Vehicle"]:
        """Leave the vehicle safe: when the block fails, is cancelled or is interrupted in flight, `action` is
        commanded. A vehicle on the ground is disarmed first. Of blocks in each other the innermost one
        commands; the others do so only for what the program commands afterwards, or after a refusal.

        A vehicle that a pilot, another ground station or a failsafe has taken is commanded nothing: the block
        ends at once with TakenOver, whatever it does.

        Args:
            action: `Mode.RETURN` (the vehicle then lands by itself), `Mode.LAND` or `Mode.HOLD`. If it is
                refused, the other two are tried.
        """
        async with self.safe_exit.guard(action):
            yield self
