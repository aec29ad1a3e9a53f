"""One aircraft's flight of the orbit: out to the target with GPS, around it without, and home."""

import asyncio
import math
from collections.abc import Callable
from contextlib import suppress
from statistics import fmean, pstdev
from typing import Any, Final

from autopilot_bridge.geodesy import GeodeticPosition, LocalFrame
from autopilot_bridge.mavlink import decode, dialect
from missions import telemetry
from missions.errors import MissionError
from missions.orbit.attitude import AttitudeSource, AutopilotAttitude
from missions.orbit.filter_attitude import FilterAttitude
from missions.orbit.guidance import OrbitCommand, OrbitGuidance, OrbitParameters
from missions.orbit.options import WANDERING_M, AttitudeFrom, OrbitOptions
from missions.orbit.score import ORBIT
from missions.orbit.tracker import TargetStatus, TargetTracker
from missions.planning.limits import FixedWingLimits
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.attitude_setpoint import AttitudeSetpoint
from missions.vehicle.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT
from missions.vehicle.vehicle import Vehicle

_GPS: Final = dialect.FAILURE_UNIT_SENSOR_GPS
_OFF, _SOUND = dialect.FAILURE_TYPE_OFF, dialect.FAILURE_TYPE_OK
_FIX_3D: Final = 3
_TICK_HZ: Final = 25.0
_GIMBAL_HZ: Final = 25.0
_GIMBAL_LEAD_S: Final = 0.15
_BELIEVED_TO_M: Final = 20.0  # how well a place from somebody else is known (paper: 20 m)
_DRIFT_STD_M_S: Final = 2.0
_ENTRY_RAD: Final = math.radians(10.0)
_CAPTURED: Final = 0.05  # of the radius
_CAPTURED_RAD: Final = math.radians(10.0)
_CAPTURED_FOR_S: Final = 5.0
_CAPTURE_LIMIT_S: Final = 240.0
_GPS_BACK_S: Final = 12.0
_INERTIAL: Final = ("HIGHRES_IMU", "RAW_IMU")
_INERTIAL_HZ: Final = (25.0, 40.0)
_FILTER_START_S: Final = 5.0


class OrbitFlight:
    """One vehicle's flight of the mission."""

    def __init__(self, vehicle: Vehicle, options: OrbitOptions, limits: FixedWingLimits) -> None:
        self._vehicle = vehicle
        self._options = options
        self._limits = limits
        self._told = AutopilotAttitude()
        filtered = options.attitude is AttitudeFrom.FILTER
        self._filter = FilterAttitude(vehicle.system_id) if filtered else None
        attitude: AttitudeSource = self._filter or self._told
        self._tracker = TargetTracker(attitude)
        bank_max = min(math.radians(50.0), 0.95 * limits.bank_max_rad)
        self._guidance = OrbitGuidance(
            OrbitParameters(radius_m=options.radius_m, direction=options.direction, bank_max_rad=bank_max)
        )
        self._pilot: AttitudePilot | None = None
        self._with_gps = True
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
        """Now, as images and attitudes are stamped: the tracker's time."""
        return self._vehicle.clock.stamp_us

    def _begin(self, phase: str) -> None:
        self._vehicle.notes.begin(phase, self._stamp_us)

    async def fly(self) -> None:
        """From the ground back to the ground.

        Raises:
            PlanError: the target would be outside what the camera can look at.
            MissionError: the flight went wrong.
        """
        vehicle, options = self._vehicle, self._options
        self._begin("preparation")
        await vehicle.payload.require(CAMERA_COMPONENT, GIMBAL_COMPONENT)
        pitch_min, pitch_max, _, _ = await vehicle.payload.request_gimbal_information()
        options.check_camera(self._limits, pitch_min, pitch_max)
        vehicle.payload.take_gimbal_control()
        vehicle.payload.set_gimbal_rate(_GIMBAL_HZ)
        pilot = self._pilot = await vehicle.prepare_piloting()
        await pilot.prepare(options.own_altitude_m, options.airspeed_m_s)
        stops = self._listen_to_attitude()
        try:
            await self._start_filter()
            self._begin("takeoff")
            await vehicle.takeoff(options.own_altitude_m)
            stops += self._listen_to_payload()
            looking = asyncio.get_running_loop().create_task(self._keep_looking())
            try:
                self._begin("transit")
                await self._fly_to_entry(looking)
                await self._orbit_without_gps(looking)
            finally:
                looking.cancel()
                await asyncio.gather(looking, return_exceptions=True)
        finally:
            for stop in stops:
                stop()
        self._begin("landing")
        await vehicle.land_along()
        vehicle.notes.end(self._stamp_us)

    # the target

    def _listen_to_payload(self) -> list[Callable[[], None]]:
        payload, tracker = self._vehicle.payload, self._tracker
        return [payload.on_gimbal_attitude(tracker.gimbal), payload.on_detection(tracker.detect)]

    def _listen_to_attitude(self) -> list[Callable[[], None]]:
        listen, own = self._vehicle.connection.listen, self._vehicle.system_id
        if self._filter is not None:
            return [listen(name, self._filter.hear) for name in sorted(self._filter.names)]

        def on_attitude(frame: Any) -> None:
            if frame.system_id == own and frame.component_id == 1:
                attitude = telemetry.attitude(decode(frame))
                if attitude is not None:
                    self._told.add(attitude)

        return [listen("ATTITUDE", on_attitude)]

    async def _start_filter(self) -> None:
        """Have our filter fed, where it is to be used: on the ground still, where it finds its biases."""
        if self._filter is None:
            return
        vehicle = self._vehicle
        for name in _INERTIAL:
            for rate_hz in _INERTIAL_HZ:  # an autopilot that finds the second too fast has granted the first
                await vehicle.set_message_rate(name, rate_hz)
            await vehicle.clock.sleep(_FILTER_START_S)
            if self._filter.newest is not None:
                return
        raise MissionError(
            f"the attitude filter hears neither {' nor '.join(_INERTIAL)}; fly with --attitude autopilot; "
            f"{vehicle.heard()}"
        )

    async def _keep_looking(self) -> None:
        """Step the tracker, and keep the gimbal on the target, all the time."""
        clock = self._vehicle.clock
        period_us = round(1e6 / _TICK_HZ)
        due_us = clock.time_us
        while True:
            self._look()
            due_us = max(due_us + period_us, clock.time_us)
            await clock.sleep_until(due_us)

    def _look(self) -> None:
        vehicle, tracker, pilot = self._vehicle, self._tracker, self._pilot
        assert pilot is not None
        height_m, airspeed_m_s = pilot.height_m, pilot.airspeed_true_m_s
        if not (math.isfinite(height_m) and math.isfinite(airspeed_m_s)):
            return
        now_us = self._stamp_us
        tracker.height(height_m - self._options.target_ground_m)
        if self._with_gps and tracker.status is not TargetStatus.SEEN:
            self._believe(now_us, airspeed_m_s)
        tracker.step(now_us, airspeed_m_s, pilot.climb_m_s)
        angles = tracker.pointing(now_us, _GIMBAL_LEAD_S)
        if angles is not None:
            vehicle.payload.point_gimbal(pitch_rad=angles[1], yaw_rad=angles[0])

    def _believe(self, now_us: int, airspeed_m_s: float) -> None:
        """While there is GPS and the target was not seen: where it is said to be, against the aircraft."""
        p = self._vehicle.latest(telemetry.Position)
        attitude = self._vehicle.latest(telemetry.Attitude)
        if p is None or attitude is None:
            return
        (north_m, east_m), (vn, ve) = self._target_ne(self._now_us)
        frame = LocalFrame(self._vehicle.home)
        own_north_m, own_east_m, _ = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        wind_n = p.vel_ned_m_s[0] - airspeed_m_s * math.cos(attitude.yaw_rad)
        wind_e = p.vel_ned_m_s[1] - airspeed_m_s * math.sin(attitude.yaw_rad)
        self._tracker.start(
            now_us,
            offset_ne_m=(north_m - own_north_m, east_m - own_east_m),
            offset_std_m=WANDERING_M if self._options.wandering else _BELIEVED_TO_M,
            drift_ne_m_s=(vn - wind_n, ve - wind_e),
            drift_std_m_s=_DRIFT_STD_M_S,
        )

    def _target_ne(self, time_us: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Place and velocity of the target as it is believed to move, from home."""
        o = self._options
        if o.wandering:  # somewhere around there
            return o.target_ne_m, (0.0, 0.0)
        velocity = (
            o.target_speed_m_s * math.cos(o.target_heading_rad),
            o.target_speed_m_s * math.sin(o.target_heading_rad),
        )
        since_s = (time_us - self._vehicle.first_heard_us) * 1e-6
        return (
            o.target_ne_m[0] + since_s * velocity[0],
            o.target_ne_m[1] + since_s * velocity[1],
        ), velocity

    # the flight

    async def _fly_to_entry(self, looking: "asyncio.Task[None]") -> None:
        """Circle so that the circle leads through the entry, along its heading; until it does."""
        vehicle, options = self._vehicle, self._options
        course = options.entry_course_rad
        radius_m = max(80.0, self._limits.turn_radius_m(options.airspeed(self._limits)))
        home = vehicle.home
        reached_us: list[int] = []
        await self._circle_for_entry(home, course, radius_m)
        placed_us = self._now_us
        while not reached_us:
            _raise_if_ended(looking)
            await vehicle.clock.sleep(0.1)
            self._require_flying()
            p, attitude = await vehicle.position(), self._told_attitude()
            (target_n, target_e), _ = self._target_ne(self._now_us)
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
            if turned < _ENTRY_RAD and off_m < 0.5 * radius_m + 30.0 and level:
                reached_us.append(self._now_us)
            elif self._now_us - placed_us > 600_000_000:
                raise MissionError(
                    f"the entry of the orbit was not reached within 600 s: still {off_m:.0f} m away; "
                    f"{vehicle.heard()}"
                )
            elif options.target_speed_m_s and (self._now_us - placed_us) % 20_000_000 < 100_000:
                await self._circle_for_entry(home, course, radius_m)  # it has moved on

    async def _circle_for_entry(self, home: GeodeticPosition, course: float, radius_m: float) -> None:
        options = self._options
        (target_n, target_e), _ = self._target_ne(self._now_us)
        right = course + 0.5 * math.pi
        north = target_n + options.entry_distance_m * math.cos(options.entry_bearing_rad)
        east = target_e + options.entry_distance_m * math.sin(options.entry_bearing_rad)
        lat, lon, alt = LocalFrame(home).geodetic_from_ned(
            north + radius_m * math.cos(right), east + radius_m * math.sin(right), -options.own_altitude_m
        )
        place = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
        await self._vehicle.loiter(place, radius_m=radius_m, clockwise=True, wait=False)

    def _told_attitude(self) -> telemetry.Attitude:
        attitude = self._vehicle.latest(telemetry.Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle tells no attitude (ATTITUDE); {self._vehicle.heard()}")
        return attitude

    def _require_flying(self) -> None:
        if not self._vehicle.armed:
            raise MissionError(f"the vehicle disarmed in flight; {self._vehicle.heard()}")

    async def _orbit_without_gps(self, looking: "asyncio.Task[None]") -> None:
        vehicle = self._vehicle
        self._begin("entry")
        self._require_air_data()
        try:
            await self._lose_gps()
            self._with_gps = False
            self._tracker.count_anew()  # on the way here the target may well have been out of sight
            async with vehicle.guided(_TICK_HZ) as guided:
                entered_us = self._now_us
                begun = not vehicle.adapter.roll_alone

                def source(_time_s: float) -> AttitudeSetpoint | None:
                    _raise_if_ended(looking)
                    setpoint = self._fly_on(entered_us)
                    return None if self._done() else setpoint

                following = asyncio.ensure_future(guided.follow(source))
                try:
                    if not begun:
                        await self._give_altitude(following)
                    await following
                finally:
                    following.cancel()
                    await asyncio.gather(following, return_exceptions=True)
                self._begin("gps back")
                await self._regain_gps()
                back_us = self._now_us + round(_GPS_BACK_S * 1e6)
                await guided.follow(lambda _t: self._fly_on(entered_us) if self._now_us < back_us else None)
        except BaseException:
            if not self._with_gps:
                with suppress(MissionError):  # what went wrong first is told
                    await self._regain_gps()
            raise

    def _require_air_data(self) -> None:
        """Without GPS the airspeed is the only speed there is."""
        assert self._pilot is not None
        airspeed_m_s = self._pilot.airspeed_true_m_s
        if not airspeed_m_s > 0.5 * self._limits.airspeed_min_m_s:
            raise MissionError(
                f"the vehicle's airspeed is {airspeed_m_s:.1f} m/s in flight (VFR_HUD), so the orbit "
                "can't be flown "
                f"without GPS; is its airspeed sensor sound? {self._vehicle.heard()}"
            )

    async def _give_altitude(self, following: "asyncio.Future[None]") -> None:
        """An autopilot that holds altitude and airspeed itself is told them in its guided mode."""
        from missions.vehicle.adapter import Mode

        vehicle = self._vehicle
        assert self._pilot is not None
        await vehicle.wait_until(
            lambda: following.done() or vehicle.custom_mode == vehicle.adapter.modes[Mode.GUIDED],
            what="guided mode",
            on=("HEARTBEAT",),
            timeout_s=10.0,
        )
        if not following.done():
            await self._pilot.begin()

    def _fly_on(self, entered_us: int) -> AttitudeSetpoint:
        """The command of now, and what it says of the flight."""
        now_us, options, tracker = self._now_us, self._options, self._tracker
        attitude = self._told_attitude()
        assert self._pilot is not None
        stamp_us = self._stamp_us
        unseen_s = tracker.unseen_s(stamp_us)
        if min(unseen_s, (now_us - entered_us) * 1e-6) > options.lost_limit_s:
            seen = "never seen" if math.isinf(unseen_s) else f"lost {unseen_s:.0f} s ago"
            raise MissionError(f"the target was {seen}; {self._vehicle.heard()}")
        # Without inertial messages nothing is seen either, and the flight ends by `lost_limit_s`; until then
        # the autopilot's roll is better than an old one.
        filtered_rad = None if self._filter is None else self._filter.roll_rad(stamp_us)
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
                    f"the circle was not reached within {_CAPTURE_LIMIT_S:g} s: believed "
                    f"{command.radius_m:.0f} m from "
                    f"the target; {self._vehicle.heard()}"
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
        vehicle = self._vehicle
        if not self._options.gps_fault:
            return
        try:
            await vehicle.command(dialect.MAV_CMD_INJECT_FAILURE, float(_GPS), float(_OFF), 0.0)
        except MissionError as error:
            raise MissionError(
                f"GPS can't be switched off in flight ({error}); fly with --no-gps-fault to orbit "
                "without using it, "
                "or allow it (PX4: SYS_FAILURE_EN 1)"
            ) from error
        vehicle.notes.marks["gps_lost_at_s"] = self._stamp_us * 1e-6

    async def _regain_gps(self) -> None:
        """GPS on, and wait for a fix (which it may have had all the time)."""
        vehicle, self._with_gps = self._vehicle, True
        notes = vehicle.notes
        if self._radii:
            notes.marks["radius_estimate_mean_m"] = fmean(self._radii)
            notes.marks["radius_estimate_std_m"] = pstdev(self._radii)
            notes.marks["altitude_estimate_error_m"] = self._height_error_m
        notes.marks["target_losses"] = float(self._tracker.losses)
        notes.marks["detections_used"] = float(self._tracker.target.accepted)
        notes.marks["detections_rejected"] = float(self._tracker.target.rejected)
        if "gps_lost_at_s" not in notes.marks:
            return
        await vehicle.command(dialect.MAV_CMD_INJECT_FAILURE, float(_GPS), float(_SOUND), 0.0)
        notes.marks["gps_back_at_s"] = self._stamp_us * 1e-6


def _raise_if_ended(task: "asyncio.Task[None]") -> None:
    """A task that should run on: what has ended it."""
    if task.done():
        task.result()
        raise MissionError("the mission's own look-out has ended")
