"""The interface of missions to a vehicle."""

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Set
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import LinkClosed, MissionError, PlanError, VehicleTimeout
from missions.kind import VehicleKind
from missions.planning.limits import FixedWingLimits, Limits
from missions.preflight.health import not_ready_because
from missions.vehicle import telemetry
from missions.vehicle.adapter import PREARM, Mode
from missions.vehicle.commands import HEARTBEAT_AGE_US
from missions.vehicle.connection import Connection
from missions.vehicle.fixed_wing import FixedWingFlight
from missions.vehicle.guided import GuidedSession, SetpointSource

_GROUND: Final = 1
_ACCEPTED: Final = 0
# at the end of a wait for readiness: time in which the autopilot reports what is missing
_REASONS_S: Final = 5.0
_FARTHEST_M: Final = 10_000.0  # largest distance from home; farther coordinates are probably a mistake
_MAY_PASS: Final = (1, 4)  # TEMPORARILY_REJECTED (PX4), FAILED (ArduPilot)


class Vehicle(FixedWingFlight):
    """A vehicle over MAVLink, PX4 or ArduPilot; its heartbeat identifies the firmware.

    All times are the vehicle's. Every wait has a deadline; a `VehicleTimeout` names what was awaited and what
    was received. Heights are above home; local positions are NED metres from home.
    """

    def __init__(self, connection: Connection, system_id: int | None = None) -> None:
        super().__init__(connection, system_id)
        self._local_origin: GeodeticPosition | None = None
        self._resuming: asyncio.Task[None] | None = None

    def _link_regained(self) -> None:
        super()._link_regained()
        if self._resuming is None or self._resuming.done():
            self._resuming = asyncio.get_running_loop().create_task(self._ask_again())

    async def _ask_again(self) -> None:
        """Request the streams again, because a link that was lost may have restarted with its own streams."""
        with suppress(MissionError):
            await self.adapter.start_streams(self)
            for name, rate_hz in tuple(self._rates_hz.items()):
                await self.set_message_rate(name, rate_hz)

    # start

    async def wait_heartbeat(self, timeout_s: float = 15.0) -> None:
        """Wait for a heartbeat of an autopilot; from then on its firmware and system id are known."""
        await self.wait_until(
            lambda: self._adapter,
            what="heartbeat of a PX4 or ArduPilot autopilot",
            on=("HEARTBEAT",),
            timeout_s=timeout_s,
        )

    async def wait_ready(self, timeout_s: float = 90.0, *, leave_mission: bool = True) -> None:
        """Wait until the vehicle could be armed: pre-arm checks, home, navigation.

        Args:
            timeout_s: time limit of each of its waits.
            leave_mission: whether a disarmed vehicle in the mode of a mission is switched to another mode. In
                that mode the checks may fail: ArduPilot's plane waits for another mode or mission after a
                landing.
        """
        await self.wait_heartbeat(timeout_s)
        await self.adapter.start_streams(self)
        if self.message("HOME_POSITION") is None:
            self._request_message("HOME_POSITION")
        adapter = self.adapter

        def in_mission() -> bool:
            return leave_mission and not self.armed and self.custom_mode == adapter.modes[Mode.MISSION]

        def ready() -> bool:
            missing = adapter.readiness(self)
            return not missing or (missing == [PREARM] and in_mission())

        await self._wait_readiness(ready, timeout_s)
        if in_mission():
            await self.set_mode(adapter.resting_mode)
            await self.rewind_mission()
            await self._wait_readiness(ready, timeout_s)

    async def _wait_readiness(self, ready: Callable[[], bool], timeout_s: float) -> None:
        """Wait until the vehicle is ready. In the last seconds the autopilot is commanded to run its checks,
        so that it reports what is missing.

        Raises:
            VehicleTimeout: it is not ready; the message contains the reasons that the autopilot reported.
        """

        async def wait(seconds: float) -> None:
            await self.wait_until(
                ready,
                what=lambda: f"readiness to fly (missing: {', '.join(self.adapter.readiness(self))})",
                on=("SYS_STATUS", "HOME_POSITION", "GLOBAL_POSITION_INT", "EKF_STATUS_REPORT"),
                timeout_s=seconds,
            )

        reasons_s = min(_REASONS_S, 0.5 * timeout_s)
        try:
            await wait(timeout_s - reasons_s)
            return
        except VehicleTimeout:
            known = {id(text) for text in self.status_texts}
            self.send_command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
        try:
            await wait(reasons_s)
        except VehicleTimeout:
            missing = self.adapter.readiness(self)
            why = ""
            if PREARM in missing:
                texts = tuple(text.text for text in self.status_texts if id(text) not in known)
                because = not_ready_because(texts, self._sensors_unhealthy)
                why = (
                    f"; the autopilot says: {because}" if because else ", and the autopilot does not say why"
                )
            raise VehicleTimeout(
                f"no readiness to fly (missing: {', '.join(missing)}) within {timeout_s:g} s{why}; "
                f"{self.heard()}"
            ) from None

    @property
    def _sensors_unhealthy(self) -> int:
        status = self.message("SYS_STATUS")
        if status is None:
            return 0
        return int(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health)

    async def limits(self, altitude_m: float = 0.0) -> Limits:
        """The limits for a planner, from the vehicle's parameters.

        Args:
            altitude_m: height of the flight above home. An aircraft turns wider in thin air, and in the wind
                of `forecast_wind_m_s`.
        """
        adapter = self.adapter
        limits = adapter.limits(
            {
                name: await self.parameter_or(name, default)
                for name, default in adapter.limiting_parameters.items()
            }
        )
        if not isinstance(limits, FixedWingLimits):
            return limits
        home = self.home_or_none()
        return replace(
            limits,
            wind_m_s=self.forecast_wind_m_s,
            air_altitude_m=altitude_m + (0.0 if home is None else home.alt_m),
        )

    # flying

    async def arm(self, timeout_s: float = 15.0) -> None:
        """Arm and wait for it in a heartbeat; after a temporary refusal it tries again until the deadline."""
        await self.adapter.prepare_arming(self)
        await self.arm_here(timeout_s)

    async def arm_here(self, timeout_s: float = 15.0) -> None:
        """As `arm`, in the present mode of the vehicle."""
        end_us = self.clock.time_us + round(timeout_s * 1e6)
        while not self.armed:
            result = await self.try_command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
            if result == _ACCEPTED:
                break
            if result not in _MAY_PASS or self.clock.time_us >= end_us:
                self.require(dialect.MAV_CMD_COMPONENT_ARM_DISARM, result)
            await self.clock.sleep(1.0)
        await self.wait_until(lambda: self.armed, what="armed heartbeat", on=("HEARTBEAT",), timeout_s=5.0)

    async def disarm(self) -> None:
        """Disarm and wait for it in a heartbeat. In the air the vehicle refuses it."""
        await self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)
        await self.wait_disarmed(5.0)

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
        self.note_runway()
        if not self.armed:
            await self.arm()
        await self.adapter.take_off(self, altitude_m)
        wings = self.kind is VehicleKind.FIXED_WING
        slack_m, level_m_s = (
            (max(3.0, 0.05 * altitude_m), 2.0) if wings else (max(0.5, 0.05 * altitude_m), 0.4)
        )

        def reached() -> bool:
            position = self.latest(telemetry.Position)
            if not self.armed:
                raise MissionError(f"the vehicle disarmed during takeoff; {self.heard()}")
            return (
                position is not None
                and position.height_m > altitude_m - slack_m
                and abs(position.vel_ned_m_s[2]) < level_m_s
            )

        await self.wait_until(
            reached,
            what=f"takeoff to {altitude_m:g} m",
            on=("GLOBAL_POSITION_INT",),
            timeout_s=timeout_s or 20.0 + 2.0 * altitude_m,
        )

    async def hold(self) -> None:
        """Stop and hold position, in a mode that needs no pilot and no setpoints."""
        await self.set_mode(Mode.HOLD)

    async def goto(
        self,
        target: GeodeticPosition,
        *,
        tolerance_m: float = 1.0,
        timeout_s: float | None = None,
    ) -> None:
        """Fly straight to a point (DO_REPOSITION) and wait until the vehicle is there and slow.

        For multicopters only, because a fixed wing can't be slow; see `loiter` for those.

        Raises:
            PlanError: the target is more than 10 km from home; nothing was sent.
            MissionError: the vehicle disarmed, or changed to a mode that this mission did not command (a
                failsafe, a pilot).
        """
        if self.kind is VehicleKind.FIXED_WING:
            raise PlanError("an aircraft with wings can't stop at a point: use loiter")
        self._check_distance(target)
        mode_before = self.custom_mode
        self._modes_asked.clear()
        await self.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, 0.0, self.adapter.unset),
            round(target.lat_deg * 1e7),
            round(target.lon_deg * 1e7),
            target.alt_m,
        )
        frame = LocalFrame(target)

        def distance_m() -> float:
            p = self.latest(telemetry.Position)
            return math.hypot(*frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)) if p else math.inf

        accepted_us = self.clock.time_us
        goto_mode = self.adapter.modes[self.adapter.goto_mode]
        expected = {mode_before, goto_mode}

        def there() -> bool:
            if self._heard_us is not None and self._heard_us >= accepted_us + HEARTBEAT_AGE_US:
                if self.custom_mode == goto_mode:  # from now on a return to the previous mode is a change too
                    expected.intersection_update((goto_mode,))
                self._require_flying(expected, lambda: f"{distance_m():.1f} m before the target")
            p = self.latest(telemetry.Position)
            return p is not None and distance_m() < tolerance_m and math.hypot(*p.vel_ned_m_s) < 0.7

        away_m = distance_m()
        limit_s = timeout_s or 30.0 + (away_m / 2.0 if math.isfinite(away_m) else 60.0)
        await self.wait_until(
            there,
            what=lambda: f"arrival (still {distance_m():.1f} m away)",
            on=("GLOBAL_POSITION_INT", "HEARTBEAT"),
            timeout_s=limit_s,
        )

    def _check_distance(self, target: GeodeticPosition) -> None:
        if self.message("HOME_POSITION") is None:
            return
        ned = LocalFrame(self.home).ned_from_geodetic(target.lat_deg, target.lon_deg, target.alt_m)
        away_m = math.hypot(*ned)
        if not away_m <= _FARTHEST_M:
            raise PlanError(
                f"the target {target} is {away_m * 1e-3:.1f} km from home; accepted: at most "
                f"{_FARTHEST_M * 1e-3:g} km"
            )

    def _require_flying(self, expected: Set[int], where: Callable[[], str]) -> None:
        """Raise an error when the vehicle is disarmed, or in a mode neither expected nor requested."""
        if not self.armed:
            happened = "is disarmed"
        elif self.custom_mode not in expected and self.custom_mode not in self._modes_asked:
            happened = f"changed to mode {self.mode}, which this mission did not ask for,"
        else:
            return
        told = f" ({self.status_texts[-1].text!r})" if self.status_texts else ""
        raise MissionError(f"the vehicle {happened} {where()}{told}; {self.heard()}")

    async def goto_ned(
        self, north_m: float, east_m: float, down_m: float, *, tolerance_m: float = 1.0
    ) -> None:
        """`goto` to a point in NED from home."""
        lat, lon, alt = LocalFrame(self.home).geodetic_from_ned(north_m, east_m, down_m)
        await self.goto(GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt), tolerance_m=tolerance_m)

    async def set_speed(self, speed_m_s: float) -> None:
        """Command the ground speed for missions, goto and return (DO_CHANGE_SPEED)."""
        await self.command(dialect.MAV_CMD_DO_CHANGE_SPEED, 1.0, speed_m_s, -1.0)

    @asynccontextmanager
    async def guided(self, rate_hz: float = 25.0) -> AsyncIterator[GuidedSession]:
        """Fly by streamed setpoints: `async with vehicle.guided() as g: await g.follow(source)`.

        PX4 receives setpoints before and continuously in OFFBOARD; between two calls of `follow` the last one
        is repeated. At the end the vehicle holds its position.
        """
        session = GuidedSession(self, rate_hz, await self.home_in_local_frame())
        try:
            yield session
            await session.finish()
        finally:
            await session.stop()

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
        await self.adapter.start_mission(self)

    async def return_to_launch(self, *, wait: bool = True, timeout_s: float = 600.0) -> None:
        """Return, land and (with `wait`) wait until the vehicle is disarmed."""
        await self.set_mode(Mode.RETURN)
        if wait:
            await self.wait_disarmed(timeout_s)

    async def land(self, *, wait: bool = True, timeout_s: float = 300.0) -> None:
        """Land here and (with `wait`) wait until the vehicle is disarmed."""
        await self.set_mode(Mode.LAND)
        if wait:
            await self.wait_disarmed(timeout_s)

    async def wait_landed(self, timeout_s: float = 300.0) -> None:
        """Wait until the vehicle reports that it is landed."""
        await self.wait_until(
            lambda: self.landed_state == _GROUND,
            what="landing",
            on=("EXTENDED_SYS_STATE",),
            timeout_s=timeout_s,
        )

    # frames

    async def local_origin(self) -> GeodeticPosition:
        """The origin of the autopilot's local frame (LOCAL_POSITION_NED, local setpoints).

        It is taken from GPS_GLOBAL_ORIGIN or, when a vehicle doesn't report that, from positions in both
        frames.
        """
        if self._local_origin is None:
            try:
                m = await self.request("GPS_GLOBAL_ORIGIN", 1.5)
                self._local_origin = GeodeticPosition(
                    lat_deg=m.latitude * 1e-7, lon_deg=m.longitude * 1e-7, alt_m=m.altitude * 1e-3
                )
            except VehicleTimeout:
                self._local_origin = await self._origin_from_positions()
        return self._local_origin

    async def _origin_from_positions(self) -> GeodeticPosition:
        def both() -> tuple[telemetry.Position, telemetry.LocalPosition] | None:
            p, q = self.latest(telemetry.Position), self.latest(telemetry.LocalPosition)
            return (p, q) if p and q and abs(p.time_us - q.time_us) <= 50_000 else None

        p, q = await self.wait_until(
            both,
            what="global and local position of one moment",
            on=("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
            timeout_s=5.0,
        )
        here = GeodeticPosition(lat_deg=p.lat_deg, lon_deg=p.lon_deg, alt_m=p.alt_m)
        lat, lon, alt = LocalFrame(here).geodetic_from_ned(*(-value for value in q.pos_ned_m))
        return GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)

    async def home_in_local_frame(self) -> tuple[float, float, float]:
        """Home as a point of the autopilot's local frame."""
        home = self.home
        return LocalFrame(await self.local_origin()).ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)

    # safety

    @asynccontextmanager
    async def safe_on_exit(self, action: Mode = Mode.RETURN) -> AsyncIterator["Vehicle"]:
        """Leave the vehicle safe: when the block fails, is cancelled or is interrupted in flight, `action` is
        commanded. A vehicle on the ground is disarmed first.

        Args:
            action: `Mode.RETURN` (the vehicle then lands by itself), `Mode.LAND` or `Mode.HOLD`. If it is
                refused, the other two are tried.
        """
        try:
            yield self
        except BaseException:
            await self._make_safe(action)
            raise

    async def _make_safe(self, action: Mode) -> None:
        # Heartbeats come once a second: after arming, the newest heartbeat may still report disarmed.
        if self._adapter is not None and self.may_be_armed:
            await asyncio.shield(asyncio.ensure_future(self._command_safe(action)))

    async def _command_safe(self, action: Mode) -> None:
        if self.landed_state == _GROUND:
            with suppress(MissionError):  # refused if it has just left the ground
                await self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, timeout_s=0.5)
        # also for a disarmed vehicle: in the mission's mode it would fly off when it is armed again
        for mode in (action, *(m for m in (Mode.RETURN, Mode.LAND, Mode.HOLD) if m is not action)):
            self.notes.left = f"was commanded to {mode} and did not answer"
            try:
                await self.set_mode(mode, 5.0)
            # the vehicle may still receive our messages: it keeps the first action commanded
            except LinkClosed:
                return
            except MissionError:
                continue
            self.notes.left = f"was commanded to {mode}"
            return
        self.notes.left = "refused to return, to land and to hold"
