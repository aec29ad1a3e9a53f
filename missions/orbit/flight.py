"""One aircraft's flight of the orbit: to the target with GPS, around it without GPS, and home."""

import asyncio
import math
from contextlib import suppress
from statistics import fmean, pstdev
from typing import Final

from estimators.orbit_target.tracker import TargetStatus
from estimators.scene_items import Gaussian, Item, Line, Pose, Relative, Role, Text
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError
from missions.orbit.checks import airspeed_of, check_camera
from missions.orbit.options import OrbitOptions
from missions.orbit.score import ORBIT
from missions.orbit.target_observer import TICK_HZ, TargetObserver
from missions.planning.orbit_guidance import OrbitCommand, OrbitGuidance, OrbitParameters
from missions.vehicle import telemetry
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.gps_switch import GpsSwitch
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.roll_flight import follow_rolls
from missions.vehicle.setpoint import AttitudeSetpoint
from missions.vehicle.vehicle import Vehicle

_GIMBAL_HZ: Final = 25.0
_ENTRY_RAD: Final = math.radians(10.0)
_CAPTURED: Final = 0.05  # of the radius: below this error the circle counts as captured
_CAPTURED_RAD: Final = math.radians(10.0)
_CAPTURED_FOR_S: Final = 5.0
_CAPTURE_LIMIT_S: Final = 240.0
_GPS_BACK_S: Final = 12.0


class OrbitFlight:
    """One vehicle's flight of the mission."""

    def __init__(self, vehicle: Vehicle, options: OrbitOptions, limits: FixedWingLimits) -> None:
        self._vehicle = vehicle
        self._options = options
        self._limits = limits
        self._observer = TargetObserver(vehicle, options)
        self._tracker = self._observer.tracker
        bank_max = min(math.radians(50.0), 0.95 * limits.bank_max_rad)
        self._guidance = OrbitGuidance(
            OrbitParameters(radius_m=options.radius_m, direction=options.direction, bank_max_rad=bank_max)
        )
        self._pilot: AttitudePilot | None = None
        self._gps: GpsSwitch | None = None
        self._looking = False  # the target is followed
        self._captured_us: int | None = None
        self._near_us: int | None = None
        self._command: OrbitCommand | None = None
        self._radii: list[float] = []
        self._height_error_m = 0.0

    @property
    def _now_us(self) -> int:
        return self._vehicle.clock.time_us

    @property
    def _stamp_us(self) -> int:
        """The present time in the base of image and attitude stamps, which is the tracker's time."""
        return self._vehicle.clock.stamp_us

    def _begin(self, phase: str) -> None:
        self._vehicle.notes.begin(phase, self._stamp_us)

    async def fly(self) -> None:
        """Fly the mission, including takeoff and landing.

        Raises:
            PlanError: the target would be outside the camera's range.
            MissionError: the flight failed.
        """
        vehicle, options = self._vehicle, self._options
        self._begin("preparation")
        pitch_min, pitch_max, _, _ = await vehicle.payload.request_gimbal_information()
        check_camera(options, self._limits, pitch_min, pitch_max)
        if options.gps_fault:
            self._gps = await GpsSwitch.find(vehicle, options.gps_off)
        vehicle.payload.take_gimbal_control()
        vehicle.payload.set_gimbal_rate(_GIMBAL_HZ)
        pilot = self._pilot = await vehicle.wing.prepare_piloting()
        await pilot.prepare(options.own_altitude_m, options.airspeed_m_s)
        stops = self._observer.listen_to_attitude()
        try:
            await self._observer.start_filter()
            self._begin("takeoff")
            await vehicle.takeoff(options.own_altitude_m)
            stops += self._observer.listen_to_payload()
            self._looking = True
            looking = asyncio.get_running_loop().create_task(self._observer.keep_looking(pilot))
            try:
                self._begin("transit")
                await self._fly_to_entry(looking)
                await self._orbit_without_gps(looking)
            finally:
                self._looking = False
                looking.cancel()
                await asyncio.gather(looking, return_exceptions=True)
        finally:
            for stop in stops:
                stop()
        vehicle.sensors.release()
        self._begin("landing")
        await vehicle.wing.land_along()
        vehicle.notes.end(self._stamp_us)

    def shown(self) -> dict[str, Item]:
        """The target as the aircraft knows it, relative to itself, and the circle around it; for viewers."""
        found: dict[str, Item] = {}
        (north_m, east_m), _ = self._observer.target_ne(self._now_us)
        given = Pose(pos_ned_m=(north_m, east_m, 0.0), role=Role.COMMANDED, label="target, as given")
        if self._observer.with_gps:
            found["given_target"] = given
        system_id, target = self._vehicle.system_id, self._tracker.target
        known = f"target {self._tracker.status.value}"
        found["target_status"] = Text(text=known, state=self._tracker.status.value, role=Role.BELIEF)
        gps = "GPS" if self._observer.with_gps else "no GPS"
        found["navigation"] = Text(text=f"flown with {gps}", state=gps, warning=not self._observer.with_gps)
        if self._looking and target.known and math.isfinite(self._tracker.height_m):
            offset = *self._tracker.state(self._stamp_us).offset_ne_m, self._tracker.height_m
            place = Gaussian(mean_ned_m=offset, covariance_m2=target.offset_covariance_m2.copy(), label=known)
            circle = Line.circle((*offset[:2], 0.0), self._options.radius_m, label="orbit")
            found["target"] = Relative(item=place, system_id=system_id)
            found["orbit"] = Relative(item=circle, system_id=system_id)
        return found

    # the flight

    async def _fly_to_entry(self, looking: "asyncio.Task[None]") -> None:
        """Fly a circle that passes through the entry point along its heading, and wait until the aircraft is
        there.
        """
        vehicle, options = self._vehicle, self._options
        course = options.entry_course_rad
        radius_m = max(80.0, self._limits.turn_radius_m(airspeed_of(options, self._limits)))
        home = vehicle.home
        reached_us: list[int] = []
        await self._circle_for_entry(home, course, radius_m)
        placed_us = self._now_us
        while not reached_us:
            _raise_if_ended(looking)
            await vehicle.clock.sleep(0.1)
            self._require_flying()
            p, attitude = await vehicle.position(), self._reported_attitude()
            (target_n, target_e), _ = self._observer.target_ne(self._now_us)
            n, e, _ = LocalFrame(home).ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
            away_m = math.hypot(n - target_n, e - target_e)
            bearing = math.atan2(e - target_e, n - target_n)
            off_m = math.dist(
                (away_m * math.cos(bearing), away_m * math.sin(bearing)),
                (
                    options.entry_distance_m * math.cos(options.entry_bearing_rad),
                    options.entry_distance_m * math.sin(options.entry_bearing_rad),
                ),
            )
            turned = abs(math.remainder(attitude.yaw_rad - course, math.tau))
            level = abs(p.height_m - options.own_altitude_m) < 8.0
            there = turned < _ENTRY_RAD and off_m < 0.5 * radius_m + 30.0 and level
            if there and self._observer.informed:
                reached_us.append(self._now_us)
            elif self._now_us - placed_us > 600_000_000:
                raise MissionError(
                    f"the entry of the orbit was not reached within 600 s: still {off_m:.0f} m away; "
                    f"{vehicle.link.last_received()}"
                )
            elif options.estimator.target_speed_m_s and (self._now_us - placed_us) % 20_000_000 < 100_000:
                await self._circle_for_entry(home, course, radius_m)  # the aircraft has moved on

    async def _circle_for_entry(self, home: GeodeticPosition, course: float, radius_m: float) -> None:
        options = self._options
        (target_n, target_e), _ = self._observer.target_ne(self._now_us)
        right = course + 0.5 * math.pi
        north = target_n + options.entry_distance_m * math.cos(options.entry_bearing_rad)
        east = target_e + options.entry_distance_m * math.sin(options.entry_bearing_rad)
        lat, lon, alt = LocalFrame(home).geodetic_from_ned(
            north + radius_m * math.cos(right), east + radius_m * math.sin(right), -options.own_altitude_m
        )
        place = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
        await self._vehicle.wing.loiter(place, radius_m=radius_m, clockwise=True, wait=False)

    def _reported_attitude(self) -> telemetry.Attitude:
        attitude = self._vehicle.latest(telemetry.Attitude)
        if attitude is None:
            raise MissionError(
                f"the vehicle reports no attitude (ATTITUDE); {self._vehicle.link.last_received()}"
            )
        return attitude

    def _require_flying(self) -> None:
        self._vehicle.link.require_armed("in flight")

    async def _orbit_without_gps(self, looking: "asyncio.Task[None]") -> None:
        vehicle = self._vehicle
        self._begin("entry")
        self._require_air_data()
        try:
            await self._lose_gps()
            self._observer.with_gps = False
            self._tracker.count_anew()  # the target may have been out of sight on the way here
            async with vehicle.guided(TICK_HZ) as guided:
                entered_us = self._now_us

                def source(_time_s: float) -> AttitudeSetpoint | None:
                    _raise_if_ended(looking)
                    setpoint = self._fly_on(entered_us)
                    return None if self._done() else setpoint

                assert self._pilot is not None
                await follow_rolls(vehicle, guided, self._pilot, source)
                self._begin("gps back")
                await self._regain_gps()
                back_us = self._now_us + round(_GPS_BACK_S * 1e6)
                await guided.follow(lambda _t: self._fly_on(entered_us) if self._now_us < back_us else None)
        except BaseException:
            if not self._observer.with_gps:
                with suppress(MissionError):  # the first error is reported
                    await self._regain_gps()
            raise

    def _require_air_data(self) -> None:
        """Check that airspeed is reported, because without GPS it is the only speed available."""
        assert self._pilot is not None
        airspeed_m_s = self._pilot.airspeed_true_m_s
        if not airspeed_m_s > 0.5 * self._limits.airspeed_min_m_s:
            raise MissionError(
                f"the vehicle's airspeed is {airspeed_m_s:.1f} m/s in flight (VFR_HUD), so the orbit "
                "can't be flown "
                f"without GPS; is its airspeed sensor sound? {self._vehicle.link.last_received()}"
            )

    def _fly_on(self, entered_us: int) -> AttitudeSetpoint:
        """Compute the current command, and note the state of the flight."""
        now_us, options, tracker = self._now_us, self._options, self._tracker
        attitude = self._reported_attitude()
        assert self._pilot is not None
        stamp_us = self._stamp_us
        unseen_s = tracker.unseen_s(stamp_us)
        if min(unseen_s, (now_us - entered_us) * 1e-6) > options.lost_limit_s:
            seen = "never seen" if math.isinf(unseen_s) else f"lost {unseen_s:.0f} s ago"
            raise MissionError(f"the target was {seen}; {self._vehicle.link.last_received()}")
        # Without inertial messages no target is seen either, and the flight ends by `lost_limit_s`; until
        # then
        # the autopilot's roll is better than an old one.
        own = self._observer.filter
        filtered_rad = None if own is None else own.roll_rad(stamp_us)
        roll_rad = attitude.roll_rad if filtered_rad is None else filtered_rad
        command = self._guidance.command(tracker.state(stamp_us), attitude.yaw_rad, roll_rad)
        self._command = command
        self._note(command, now_us, entered_us)
        return self._pilot.setpoint(now_us, command.roll_rad)

    def _note(self, command: OrbitCommand, now_us: int, entered_us: int) -> None:
        options, notes = self._options, self._vehicle.notes
        if self._captured_us is None:
            near = (
                abs(command.radius_error_m) < _CAPTURED * options.radius_m
                and abs(command.chi_error_rad) < _CAPTURED_RAD
                and self._tracker.status is TargetStatus.SEEN
            )
            self._near_us = (self._near_us or now_us) if near else None
            if self._near_us is not None and now_us - self._near_us >= _CAPTURED_FOR_S * 1e6:
                self._captured_us = now_us
                self._begin(ORBIT)
                notes.marks["orbit_captured_after_s"] = (now_us - entered_us) * 1e-6
            elif now_us - entered_us > _CAPTURE_LIMIT_S * 1e6:
                raise MissionError(
                    f"the circle was not reached within {_CAPTURE_LIMIT_S:g} s: estimated "
                    f"{command.radius_m:.0f} m from "
                    f"the target; {self._vehicle.link.last_received()}"
                )
            return
        if not self._done():
            assert self._pilot is not None
            self._radii.append(command.radius_m)
            self._height_error_m = max(
                self._height_error_m, abs(self._pilot.height_m - options.own_altitude_m)
            )
        notes.progress = min(1.0, (now_us - self._captured_us) * 1e-6 / options.duration_s)

    def _done(self) -> bool:
        if self._captured_us is None:
            return False
        return self._now_us - self._captured_us >= self._options.duration_s * 1e6

    # GPS

    async def _lose_gps(self) -> None:
        if self._gps is not None:
            await self._gps.off()
            self._vehicle.notes.marks["gps_lost_at_s"] = self._stamp_us * 1e-6

    async def _regain_gps(self) -> None:
        """Switch GPS on and wait for a fix (which the receiver may have had all the time)."""
        vehicle, self._observer.with_gps = self._vehicle, True
        notes = vehicle.notes
        if self._radii:
            notes.marks["radius_estimate_mean_m"] = fmean(self._radii)
            notes.marks["radius_estimate_std_m"] = pstdev(self._radii)
            notes.marks["altitude_estimate_error_m"] = self._height_error_m
        notes.marks["target_losses"] = float(self._tracker.losses)
        notes.marks["detections_used"] = float(self._tracker.target.accepted)
        notes.marks["detections_rejected"] = float(self._tracker.target.rejected)
        if self._gps is None or "gps_lost_at_s" not in notes.marks:
            return
        await self._gps.on()
        notes.marks["gps_back_at_s"] = self._stamp_us * 1e-6


def _raise_if_ended(task: "asyncio.Task[None]") -> None:
    """Raise the reason why a task that should continue has ended."""
    if task.done():
        task.result()
        raise MissionError("the observation of the target has ended")
