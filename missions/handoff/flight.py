"""The flights of both aircraft of a handoff, from takeoff to landing."""

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators.handoff import HandoffEstimator
from estimators.orbit_target.relative_target import RelativeState
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import LevelVector
from missions.errors import MissionError
from missions.handoff.camera import GIMBAL_HZ, GimbalPointing
from missions.handoff.checks import check_vehicle
from missions.handoff.operator import TrackOperator
from missions.handoff.options import HandoffOptions
from missions.planning.orbit_guidance import OrbitGuidance, OrbitParameters
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.gps_switch import GpsSwitch
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.roll_flight import follow_rolls
from missions.vehicle.setpoint import AttitudeSetpoint
from missions.vehicle.telemetry import Attitude, Position
from missions.vehicle.vehicle import Vehicle

_RATES_HZ: Final = {"HIGHRES_IMU": 50.0, "RAW_IMU": 40.0, "SCALED_PRESSURE": 20.0, "GLOBAL_POSITION_INT": 5.0}
_SEARCH_ROLL_RAD: Final = math.radians(15.0)  # of the circle that is flown until the pose is known
_ARRIVAL_S: Final = 900.0
_GPS_BACK_S: Final = 12.0
_RECENTRE_S: Final = 10.0
TICK_HZ: Final = 25.0


class HandoffRun:
    """What both flights of a handoff share.

    Args:
        meet: called when the handoff aircraft arrives: from then on there is radio contact.

    Attributes:
        tracking: the tracker follows the target.
        over: the tracker may go home: the target was handed over, or time is over.
        decided_us: time of the decision; None: not yet.
        gps_lost_us: time at which the handoff aircraft has lost GPS; None: not yet.
    """

    def __init__(self, meet: Callable[[], None]) -> None:
        self.meet = meet
        self.tracking = False
        self.over = False
        self.decided_us: int | None = None
        self.gps_lost_us: int | None = None


class HandoffAircraft(ABC):
    """One aircraft of a handoff, with what both do alike.

    Args:
        vehicle: the aircraft, ready to arm.
        options: adapted to it.
        estimator: its own.
        run: shared with the other aircraft.
    """

    def __init__(
        self, vehicle: Vehicle, options: HandoffOptions, estimator: HandoffEstimator, run: HandoffRun
    ) -> None:
        self.vehicle = vehicle
        self.options = options
        self.estimator = estimator
        self.run = run
        self._limits: FixedWingLimits | None = None
        self._pilot: AttitudePilot | None = None
        self._gimbal: GimbalPointing | None = None
        self._with_gps = True

    @abstractmethod
    async def fly(self) -> None:
        """Fly this aircraft's part, including takeoff and landing."""

    @property
    def limits(self) -> FixedWingLimits:
        """Of the aircraft; known after `prepare`."""
        assert self._limits is not None
        return self._limits

    @property
    def pilot(self) -> AttitudePilot:
        """Rolls and height; known after `prepare`."""
        assert self._pilot is not None
        return self._pilot

    def begin(self, phase: str) -> None:
        """Note the begin of a phase."""
        self.vehicle.notes.begin(phase, self.vehicle.clock.stamp_us)

    async def prepare(self) -> None:
        """Check the aircraft and request its messages, on the ground."""
        vehicle, options = self.vehicle, self.options
        self.begin("preparation")
        limits = await vehicle.limits(options.own_altitude_m)
        check_vehicle(options, limits)
        assert isinstance(limits, FixedWingLimits)
        self._limits = limits
        self._gimbal = GimbalPointing(vehicle)
        self._pilot = await vehicle.wing.prepare_piloting()
        await self._pilot.prepare(options.own_altitude_m, options.airspeed_m_s)
        for name, rate_hz in _RATES_HZ.items():
            await vehicle.commands.set_message_rate(name, rate_hz)
        await vehicle.commands.request(dialect.MAVLink_home_position_message, 3.0)

    def expected(self) -> LevelVector | None:
        """Forward and right of the reported place of the target, by GPS; None: not known."""
        p, attitude = self.vehicle.latest(Position), self.vehicle.latest(Attitude)
        if p is None or attitude is None or not self._with_gps:
            return None
        own = LocalFrame(self.vehicle.home).ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        north, east = self.options.target_ne_m[0] - own[0], self.options.target_ne_m[1] - own[1]
        c, s = math.cos(attitude.yaw_rad), math.sin(attitude.yaw_rad)
        return c * north + s * east, -s * north + c * east

    def pointing(self) -> LevelVector | None:
        """Forward and right of where the camera is pointed; None: nowhere."""
        return self.estimator.target() or self.expected()

    @asynccontextmanager
    async def looking(self) -> AsyncIterator[asyncio.Task[None]]:
        """Keep the target, or the place where it is expected, in view."""
        task = asyncio.get_running_loop().create_task(self._keep_looking())
        try:
            yield task
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    async def _keep_looking(self) -> None:
        clock, period_us = self.vehicle.clock, round(1e6 / GIMBAL_HZ)
        due_us = clock.time_us
        while True:
            self.look()
            due_us = max(due_us + period_us, clock.time_us)
            await clock.sleep_until(due_us)

    def look(self) -> None:
        """Point the camera."""
        assert self._gimbal is not None
        place, height_m = self.pointing(), self.pilot.height_m
        if place is not None and math.isfinite(height_m):
            self._gimbal.point(place, height_m)

    async def circle(self, place_ne_m: LevelVector, radius_m: float, *, clockwise: bool) -> None:
        """Circle a place by GPS, without waiting."""
        vehicle, options = self.vehicle, self.options
        lat, lon, alt = LocalFrame(vehicle.home).geodetic_from_ned(*place_ne_m, -options.own_altitude_m)
        place = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
        await vehicle.wing.loiter(place, radius_m=radius_m, clockwise=clockwise, wait=False)

    async def wait(self, ready: Callable[[], bool], what: str, timeout_s: float) -> None:
        """Wait in the air.

        Raises:
            MissionError: the aircraft disarmed, or the time is over.
        """

        def look() -> bool:
            self.vehicle.link.require_armed(f"while it waited for {what}")
            return ready()

        await self.vehicle.link.wait_until(
            look, what=what, on=("HEARTBEAT", "SCALED_PRESSURE"), timeout_s=timeout_s
        )

    def away_m(self, place_ne_m: LevelVector) -> float:
        """Horizontal distance from a place, by GPS; infinite: not known."""
        p = self.vehicle.latest(Position)
        if p is None:
            return math.inf
        north, east, _ = LocalFrame(self.vehicle.home).ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        return math.dist((north, east), place_ne_m)

    def level(self) -> bool:
        """Whether the aircraft is at its altitude."""
        p = self.vehicle.latest(Position)
        return p is not None and abs(p.height_m - self.options.own_altitude_m) < 10.0

    async def land(self) -> None:
        """Go home and land."""
        self.vehicle.sensors.release()
        self.begin("landing")
        await self.vehicle.wing.land_along()
        self.vehicle.notes.end(self.vehicle.clock.stamp_us)


class TrackerFlight(HandoffAircraft):
    """The aircraft that tracks the target, with GPS, until it has received the decision.

    Args:
        vehicle, options, estimator, run: as for both.
        designate: sends the operator's designation of a track.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        options: HandoffOptions,
        estimator: HandoffEstimator,
        run: HandoffRun,
        designate: Callable[[int], None],
    ) -> None:
        super().__init__(vehicle, options, estimator, run)
        self._operator = TrackOperator(options.confirm_after_s, options.estimator.decision, designate)

    def look(self) -> None:
        super().look()
        self._operator.look(
            self.vehicle.clock.time_us, self.estimator.designation, self.estimator.sight.tracks.places
        )

    async def fly(self) -> None:
        """Fly the tracker's part, including takeoff and landing."""
        options, run = self.options, self.run
        await self.prepare()
        self.begin("takeoff")
        await self.vehicle.takeoff(options.own_altitude_m)
        async with self.looking():
            self.begin("transit")
            await self.circle(options.target_ne_m, options.tracker_radius_m, clockwise=True)
            near_m = 1.3 * options.tracker_radius_m
            await self.wait(
                lambda: (
                    self.estimator.designation.number is not None
                    and self.level()
                    and self.away_m(options.target_ne_m) < near_m
                ),
                "an orbit around a track of the target",
                _ARRIVAL_S,
            )
            run.tracking = True
            self.begin("tracking")
            await self._track()
        if not self.estimator.released:
            self.vehicle.notes.warn("the tracker went home without a decision: the time was over")
        await self.land()

    async def _track(self) -> None:
        """Circle the target until it is handed over."""
        run, clock = self.run, self.vehicle.clock
        while not (self.estimator.released or run.over):
            place = self._target_ne_m()
            if place is not None:
                await self.circle(place, self.options.tracker_radius_m, clockwise=True)
            await self.wait(
                self._released_or(clock.time_us + round(_RECENTRE_S * 1e6)),
                "the decision of the other aircraft",
                4.0 * _RECENTRE_S,
            )
        self.vehicle.notes.marks["released_at_s"] = self.vehicle.clock.stamp_us * 1e-6

    def _released_or(self, until_us: int) -> Callable[[], bool]:
        """Whether the tracker may go home, or a time has come."""
        return lambda: self.estimator.released or self.run.over or self.vehicle.clock.time_us >= until_us

    def _target_ne_m(self) -> LevelVector | None:
        """Place of the tracked target from home, by the aircraft's own position."""
        place, attitude = self.estimator.target(), self.vehicle.latest(Attitude)
        p = self.vehicle.latest(Position)
        if place is None or attitude is None or p is None:
            return None
        north, east, _ = LocalFrame(self.vehicle.home).ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        c, s = math.cos(attitude.yaw_rad), math.sin(attitude.yaw_rad)
        return north + c * place[0] - s * place[1], east + s * place[0] + c * place[1]


class TakeoverFlight(HandoffAircraft):
    """The handoff aircraft: it arrives, loses GPS, and takes the target over."""

    def __init__(
        self, vehicle: Vehicle, options: HandoffOptions, estimator: HandoffEstimator, run: HandoffRun
    ) -> None:
        super().__init__(vehicle, options, estimator, run)
        self._guidance: OrbitGuidance | None = None
        self._handed_us: int | None = None

    async def fly(self) -> None:
        """Fly the handoff aircraft's part, including takeoff and landing."""
        vehicle, options, run = self.vehicle, self.options, self.run
        gps = await GpsSwitch.find(vehicle, options.gps_off) if options.gps_fault else None
        await self.prepare()
        bank_max = min(math.radians(50.0), 0.95 * self.limits.bank_max_rad)
        # opposite orbits of different radius: the relative pose is easiest to observe in them
        self._guidance = OrbitGuidance(
            OrbitParameters(radius_m=options.radius_m, direction=-1, bank_max_rad=bank_max)
        )
        self.begin("takeoff")
        await vehicle.takeoff(options.own_altitude_m)
        async with self.looking() as task:
            self.begin("transit")
            await self.circle(options.start_ne_m, options.radius_m, clockwise=False)
            near_m = 1.3 * options.radius_m
            await self.wait(
                lambda: run.tracking and self.level() and self.away_m(options.start_ne_m) < near_m,
                "arrival, and the tracker's target",
                _ARRIVAL_S,
            )
            await self._without_gps(gps, task)
        await self.land()

    async def _without_gps(self, gps: GpsSwitch | None, looking: asyncio.Task[None]) -> None:
        vehicle, run = self.vehicle, self.run
        try:
            if gps is not None:
                await gps.off()
            self._with_gps = False
            run.meet()
            run.gps_lost_us = vehicle.clock.stamp_us
            vehicle.notes.marks["gps_lost_at_s"] = run.gps_lost_us * 1e-6
            self.begin("relative pose")
            began_us = vehicle.clock.time_us
            async with vehicle.guided(TICK_HZ) as guided:

                def source(_time_s: float) -> AttitudeSetpoint | None:
                    if looking.done():
                        looking.result()
                    setpoint = self._setpoint()
                    return None if self._done(began_us) else setpoint

                await follow_rolls(vehicle, guided, self.pilot, source)
                self.begin("gps back")
                await self._regain(gps)
                back_us = vehicle.clock.time_us + round(_GPS_BACK_S * 1e6)
                await guided.follow(lambda _t: self._setpoint() if vehicle.clock.time_us < back_us else None)
        except BaseException:
            if not self._with_gps:
                with suppress(MissionError):  # the first error is reported
                    await self._regain(gps)
            raise
        finally:
            run.over = True

    async def _regain(self, gps: GpsSwitch | None) -> None:
        self._with_gps = True
        if gps is not None:
            await gps.on()
        self.vehicle.notes.marks["gps_back_at_s"] = self.vehicle.clock.stamp_us * 1e-6

    def _done(self, began_us: int) -> bool:
        """Whether the target was followed alone for long enough, or no decision came in time."""
        now_us, options, process = self.vehicle.clock.time_us, self.options, self.estimator.process
        notes = self.vehicle.notes
        if self.run.decided_us is None and process.decided_us is not None:
            self.run.decided_us = process.decided_us
            notes.marks["decided_after_s"] = (now_us - began_us) * 1e-6
            self.begin("decided")
        if self._handed_us is None and self.estimator.released:
            self._handed_us = now_us
            notes.marks["handed_over_after_s"] = (now_us - began_us) * 1e-6
            self.begin("takeover")
        if self._handed_us is not None:
            return now_us - self._handed_us >= options.takeover_s * 1e6
        notes.progress = min(1.0, (now_us - began_us) * 1e-6 / options.timeout_s)
        return now_us - began_us >= options.timeout_s * 1e6

    def _setpoint(self) -> AttitudeSetpoint:
        """The present command: an orbit around the target, or a circle until it is known where it is."""
        vehicle = self.vehicle
        attitude = vehicle.latest(Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle reports no attitude (ATTITUDE); {vehicle.link.last_received()}")
        vehicle.link.require_armed("in flight")
        place, roll_rad = self.estimator.target(), -_SEARCH_ROLL_RAD
        if place is not None:
            assert self._guidance is not None
            state = RelativeState(
                time_us=vehicle.clock.stamp_us,
                offset_ne_m=place,
                offset_rate_ne_m_s=self._rate(),
                offset_std_m=0.0,
            )
            roll_rad = self._guidance.command(state, 0.0, attitude.roll_rad).roll_rad
        return self.pilot.setpoint(vehicle.clock.time_us, roll_rad)

    def _rate(self) -> LevelVector:
        """Rate of the offset to the target in level axes: the velocity of its track, if there is one, less
        the aircraft's, both against the air.
        """
        own, process = self.pilot.airspeed_true_m_s, self.estimator.process
        velocity = process.tracks.velocity(process.comparison.decided)
        return velocity[0] - own, velocity[1]
