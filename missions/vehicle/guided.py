"""Streamed setpoints: PX4's OFFBOARD and ArduPilot's GUIDED, with their conditions for entry."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import home_of
from flightsim.foundation.geodesy import FrameAt, GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import Vector
from missions.errors import MissionError, PlanError, VehicleTimeout
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.setpoint import AnySetpoint, Setpoint, unmoved
from missions.vehicle.telemetry import LocalPosition, Position

SetpointSource = Callable[[float], AnySetpoint | None]
"""Vehicle seconds since the start -> setpoint NED from home (or an attitude), or None at the end."""

_BEFORE_ENTRY_S: Final = 0.6
_SLOWEST_HZ: Final = 2.5
# of a period: a setpoint is valid until the next one, so it is computed for the middle of that time
_LEAD: Final = 0.5
_ORIGIN_STEPS: Final = 3


class GuidedSession:
    """Setpoints streamed to one vehicle, at a fixed rate of vehicle time.

    While no message is received from the vehicle, the last place is held. When the link is back and the
    vehicle is still in the guided mode, the source continues from there.
    """

    def __init__(self, commands: VehicleCommands, rate_hz: float, local: Callable[[Vector], Vector]) -> None:
        if not _SLOWEST_HZ <= rate_hz <= 200.0:
            raise MissionError(
                f"a setpoint rate of {rate_hz:g} Hz does not keep a vehicle guided: {_SLOWEST_HZ:g}..200"
            )
        self._commands = commands
        self._link = commands.link
        self._period_us = round(1e6 / rate_hz)
        self._local = local
        self._source: SetpointSource | None = None
        self._start_us = 0
        self._last: AnySetpoint | None = None
        self._done = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._entered = False

    async def follow(self, source: SetpointSource) -> None:
        """Follow a source from its time 0 to its end.

        Raises:
            TakenOver: the vehicle left the guided mode: a failsafe or a pilot has it.
            LinkClosed: its link was lost.
            MissionError: it disarmed.
            PlanError: the source returned something that is not a setpoint, or a position below home, which
                is not allowed (`Vehicle.allow_below_home`).
        """
        first = self._setpoint_of(source, 0.0)
        if first is None:
            return
        if not self._entered:
            self._last = first
            await self._enter()
        self._done.clear()
        self._start_us = self._link.clock.time_us + self._period_us
        self._source = source
        assert self._task is not None
        await self._until_done(self._task)

    async def finish(self) -> None:
        """Switch from the guided mode to hold while setpoints are still sent, so that no failsafe detects a
        gap.
        """
        if self._entered:
            await self._commands.set_mode(Mode.HOLD)
            self._entered = False

    def hold(self) -> None:
        """Stream the setpoint for waiting, also after an error of the source: a vehicle whose setpoints stop
        is in a failsafe a second later (PX4).
        """
        if self._task is None:
            return
        self._source, self._last = None, _held(self._last)
        if self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._stream())

    async def stop(self) -> None:
        """Stop streaming."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None

    async def _enter(self) -> None:
        firmware = self._link.firmware
        if not firmware.setpoints_before_guided:
            await self._commands.set_mode(Mode.GUIDED)
        self._task = asyncio.get_running_loop().create_task(self._stream())
        if firmware.setpoints_before_guided:
            await self._link.clock.sleep(_BEFORE_ENTRY_S)
            await self._commands.set_mode(Mode.GUIDED)
        self._entered = True

    async def _stream(self) -> None:
        link, clock = self._link, self._link.clock
        due_us = clock.time_us
        while True:
            if link.quiet:  # the vehicle's position is not known: hold the setpoint
                self._start_us += self._period_us
                self._last = _held(self._last)
            elif self._source is not None:
                elapsed_s = max(0.0, (due_us - self._start_us + _LEAD * self._period_us) * 1e-6)
                setpoint = self._setpoint_of(self._source, elapsed_s)
                if setpoint is None:
                    self._source = None
                    self._done.set()
                else:
                    self._last = setpoint
            if self._last is not None:
                link.send(self._last.message(due_us, link.system_id, self._local))
            due_us += self._period_us
            # too late: continue from the present time, without a burst
            if due_us < clock.time_us - self._period_us:
                due_us = clock.time_us
            await clock.sleep_until(due_us)

    def _setpoint_of(self, source: SetpointSource, time_s: float) -> AnySetpoint | None:
        given: object = source(time_s)
        if isinstance(given, Setpoint) and given.position_ned_m is not None:
            self._commands.heights.check(-given.position_ned_m[2], f"follow, {time_s:.1f} s")
        if given is None or isinstance(given, AnySetpoint):
            return given
        raise PlanError(
            f"follow's source gave a {type(given).__name__} ({given!r}); accepted: a Setpoint, an "
            "AttitudeSetpoint or None"
        )

    async def _until_done(self, stream: asyncio.Task[None]) -> None:
        link = self._link
        target = link.firmware.modes[Mode.GUIDED]
        left = asyncio.get_running_loop().create_future()
        disarmed = asyncio.get_running_loop().create_future()
        flying = link.armed

        def look(_frame: object) -> None:
            if flying and not link.armed and link.custom_mode == target and not disarmed.done():
                disarmed.set_result(None)
            if link.just_back or link.taken_over() is not None:
                return  # PX4 returns to OFFBOARD by itself when setpoints are received again
            if not left.done() and link.custom_mode != target:
                left.set_result(link.mode)

        stop = link.connection.listen("HEARTBEAT", look)
        done = asyncio.ensure_future(self._done.wait())
        try:
            async with link.guard("the end of the setpoints"):
                await asyncio.wait({done, left, disarmed, stream}, return_when=asyncio.FIRST_COMPLETED)
            if stream.done():
                await stream  # raises the error that ended it
            if disarmed.done() and not done.done():
                link.require_armed("before the end of the setpoints")
            if left.done() and not done.done():  # commanded by this program itself
                raise MissionError(
                    f"the vehicle left the guided mode for {left.result()}; {link.last_received()}"
                )
        finally:
            stop()
            done.cancel()
            left.cancel()
            disarmed.cancel()
            self._source = None


@asynccontextmanager
async def guided_session(
    commands: VehicleCommands, rate_hz: float, local: Callable[[Vector], Vector] = unmoved
) -> AsyncIterator[GuidedSession]:
    """A session that ends with a hold. When the block fails where the vehicle will be left safe, the vehicle
    is kept in its place by setpoints until that is done.

    Args:
        commands: commands to the vehicle.
        rate_hz: setpoints per vehicle second.
        local: the place in the autopilot's local frame of a setpoint's place.
    """
    session = GuidedSession(commands, rate_hz, local)
    try:
        yield session
        await session.finish()
    except BaseException:
        if commands.until_safe is not None:
            session.hold()
            commands.until_safe.append(session.stop)
        else:
            await session.stop()
        raise
    await session.stop()


class LocalOrigin:
    """The origin of the autopilot's local frame (LOCAL_POSITION_NED, local setpoints).

    Args:
        commands: commands to the vehicle.
    """

    def __init__(self, commands: VehicleCommands) -> None:
        self._commands = commands
        self._link = commands.link
        self._origin: GeodeticPosition | None = None

    async def find(self) -> GeodeticPosition:
        """The origin, from GPS_GLOBAL_ORIGIN or, when a vehicle doesn't report that, from positions in both
        frames.
        """
        if self._origin is None:
            try:
                origin = home_of(await self._commands.request(dialect.MAVLink_gps_global_origin_message, 1.5))
            except VehicleTimeout:
                origin = None
            self._origin = origin or await self._from_positions()
        return self._origin

    async def _from_positions(self) -> GeodeticPosition:
        def both() -> tuple[Position, LocalPosition] | None:
            p, q = self._link.latest(Position), self._link.latest(LocalPosition)
            return (p, q) if p and q and abs(p.time_us - q.time_us) <= 50_000 else None

        p, q = await self._link.wait_until(
            both,
            what="global and local position of one moment",
            on=("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
            timeout_s=5.0,
        )
        here = GeodeticPosition(lat_deg=p.lat_deg, lon_deg=p.lon_deg, alt_m=p.alt_m)
        return _origin_of(here, q.pos_ned_m, self._link.firmware.frame_at)

    async def from_home(self) -> Callable[[Vector], Vector]:
        """The conversion of places in NED from home, in the metres of WGS84, into the autopilot's local
        frame, which has metres of its own.
        """
        home, local = LocalFrame(self._link.home), self._link.firmware.frame_at(await self.find())

        def convert(place_ned_m: Vector) -> Vector:
            return local.ned_from_geodetic(*home.geodetic_from_ned(*place_ned_m))

        return convert


def _origin_of(place: GeodeticPosition, pos_ned_m: Vector, frame_at: FrameAt) -> GeodeticPosition:
    """The origin of the local frame in which a place has a position."""
    origin = place
    for _ in range(_ORIGIN_STEPS):  # a frame's metres differ by 0.3 %, so each step is 300 times closer
        at = frame_at(origin).ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
        lat, lon, alt = LocalFrame(origin).geodetic_from_ned(
            *(now - wanted for now, wanted in zip(at, pos_ned_m, strict=True))
        )
        origin = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
    return origin


def _held(setpoint: AnySetpoint | None) -> AnySetpoint | None:
    """The setpoint for waiting: the same place, at rest; a setpoint without a place is not changed."""
    if not isinstance(setpoint, Setpoint) or setpoint.position_ned_m is None:
        return Setpoint(velocity_ned_m_s=(0.0, 0.0, 0.0)) if isinstance(setpoint, Setpoint) else setpoint
    return Setpoint(position_ned_m=setpoint.position_ned_m, yaw_rad=setpoint.yaw_rad)
