"""Flying a pattern with wings: as an uploaded mission that lands at its end, or along the path by setpoints."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from autopilot_bridge.geodesy import GeodeticPosition, LocalFrame
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from missions import telemetry
from missions.errors import MissionError, PlanError, VehicleTimeout
from missions.notes import PATTERN, CommandedPath
from missions.options import FlightOptions, Via
from missions.patterns.curve import Curve
from missions.planning.flyable import FlyablePath, flyable_path
from missions.planning.limits import GRAVITY_M_S2, FixedWingLimits
from missions.planning.turns import check_turns
from missions.vehicle.fixed_wing import Approach
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.vehicle import Vehicle

_DEVIATION_M: Final = 2.0
_SPACING_MIN_M: Final = 40.0
_SPACING_MAX_M: Final = 300.0
_APPROACH_LAYER_M: Final = 15.0
_LEAD_S: Final = 0.3
_COURSE_HZ: Final = 5.0
_CROSS_TRACK_S: Final = 4.0  # time in which a distance from the path is steered away
_STEEPEST_RAD: Final = math.radians(60.0)
_COURSE: Final = 0.0  # GUIDED_CHANGE_HEADING: over ground


def check_wings(curve: Curve, options: FlightOptions, limits: FixedWingLimits) -> float:
    """Refuse a pattern that an aircraft can't fly; gives the turn radius it was checked for.

    Raises:
        PlanError: says what, and which option to change.
    """
    if options.period_s is not None:
        raise PlanError(
            "--period is for vehicles that can fly slowly in bends; choose --speed for an aircraft"
        )
    limits.check_airspeed(options.speed_m_s)
    limits.check_altitude(options.own_altitude_m)
    coarse = curve.points(np.linspace(0.0, curve.end, 1000))
    limits.check_reach(float(np.hypot(*coarse.T).max()))
    return check_turns(curve, options.speed_m_s, limits)


async def fly_pattern_with_wings(
    vehicle: Vehicle, options: FlightOptions, curve: Curve, limits: FixedWingLimits
) -> None:
    """From the ground back to the ground; see `missions.pattern_flight.fly_pattern`."""
    radius_m = check_wings(curve, options, limits)
    path = flyable_path(curve, radius_m)
    if options.search_time_s is not None:
        path = path.until(options.search_time_s * options.speed_m_s)
    centre = (0.0, 0.0)
    if options.centre is not None:
        c = options.centre
        north, east, _ = LocalFrame(vehicle.home).ned_from_geodetic(c.lat_deg, c.lon_deg, c.alt_m)
        centre = (north, east)
    path = replace(path, points_m=path.points_m + np.array(centre))
    if options.via is Via.SETPOINTS:
        await _fly_setpoints(vehicle, options, path, radius_m)
    else:
        await _fly_waypoints(vehicle, options, path, radius_m)


def _commanded(
    vehicle: Vehicle,
    options: FlightOptions,
    path: FlyablePath,
    waypoints: list[tuple[float, float]],
    near_m: float,
) -> CommandedPath:
    down_m = -options.own_altitude_m
    return CommandedPath(
        origin=vehicle.home,
        points_ned_m=np.column_stack((path.points_m, np.full(len(path.points_m), down_m))),
        waypoints_ned_m=np.array([(n, e, down_m) for n, e in waypoints]).reshape(-1, 3),
        acceptance_m=near_m,
    )


# waypoints


async def _fly_waypoints(
    vehicle: Vehicle, options: FlightOptions, path: FlyablePath, radius_m: float
) -> None:
    notes, clock = vehicle.notes, vehicle.clock
    waypoints = path.waypoints(
        deviation_m=_DEVIATION_M, spacing_min_m=_SPACING_MIN_M, spacing_max_m=_SPACING_MAX_M
    )
    acceptance_m = await vehicle.adapter.acceptance_m(vehicle, options.acceptance_m)
    vehicle.note_runway()
    frame = LocalFrame(vehicle.home)
    items = [vehicle.adapter.takeoff_item(vehicle.home, options.own_altitude_m)]
    items.append(
        MissionItem(
            command=dialect.MAV_CMD_DO_CHANGE_SPEED,
            frame=dialect.MAV_FRAME_MISSION,
            param1=0.0,  # airspeed
            param2=options.speed_m_s,
            param3=-1.0,
        )
    )
    first = len(items)
    for north_m, east_m in waypoints:
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        items.append(
            MissionItem(
                command=dialect.MAV_CMD_NAV_WAYPOINT,
                param2=options.acceptance_m,
                param4=vehicle.adapter.unset,
                x=lat,
                y=lon,
                z=options.own_altitude_m,
            )
        )
    last = len(items) - 1
    items += _approach(vehicle, options, radius_m).items()
    notes.commanded = _commanded(vehicle, options, path, waypoints, acceptance_m)
    notes.begin("upload", clock.time_us)
    start = await vehicle.upload_mission(items)
    notes.begin("takeoff", clock.time_us)
    await vehicle.start_mission()
    reach_m = float(np.hypot(*path.points_m.T).max())
    slow_m_s = 0.5 * options.speed_m_s
    await vehicle.wait_item_reached(start + first, 180.0 + 2.0 * options.own_altitude_m + reach_m / slow_m_s)
    notes.begin(PATTERN, clock.time_us)

    def progress(done: int) -> None:
        notes.progress = min(1.0, max(0.0, (done - start - first) / max(1, last - first)))

    limit_s = 60.0 + path.length_m / slow_m_s
    try:
        await vehicle.wait_item_reached(
            start + last, min(limit_s, options.search_time_s or limit_s), progress
        )
    except VehicleTimeout:
        if options.search_time_s is None:
            raise
        await vehicle.land_along(_approach(vehicle, options, radius_m), wait=False)  # the search time is over
    notes.begin("return", clock.time_us)
    await vehicle.wait_disarmed(600.0 + 2.0 * reach_m / slow_m_s)
    notes.end(clock.time_us)


def _approach(vehicle: Vehicle, options: FlightOptions, radius_m: float) -> Approach:
    return Approach(
        place=vehicle.home,
        heading_rad=vehicle.landing_heading_rad(),
        height_m=40.0 + _APPROACH_LAYER_M * options.index,
        circle_radius_m=max(80.0, radius_m),
    )


# setpoints


async def _fly_setpoints(
    vehicle: Vehicle, options: FlightOptions, path: FlyablePath, radius_m: float
) -> None:
    notes, clock = vehicle.notes, vehicle.clock
    notes.commanded = _commanded(vehicle, options, path, [], options.acceptance_m)
    notes.begin("takeoff", clock.time_us)
    await vehicle.takeoff(options.own_altitude_m)
    notes.commanded = replace(notes.commanded, origin=vehicle.home)  # arming has set it anew
    notes.begin("transit", clock.time_us)
    await _to_the_start(vehicle, options, path, radius_m)
    notes.begin(PATTERN, clock.time_us)
    follower = _PathFollower(vehicle, options, path)
    if vehicle.adapter.roll_alone:
        await _follow_by_courses(vehicle, options, follower)
    else:
        await vehicle.change_airspeed(options.speed_m_s)
        await vehicle.follow(lambda _t: follower.setpoint(), options.rate_hz)
    notes.begin("return", clock.time_us)
    await vehicle.land_along(_approach(vehicle, options, radius_m))
    notes.end(clock.time_us)


async def _to_the_start(vehicle: Vehicle, options: FlightOptions, path: FlyablePath, radius_m: float) -> None:
    """A circle that touches the path at its start, until the aircraft passes there in its direction."""
    (north, east), course, _ = path.at(0.0)
    right = course + 0.5 * math.pi
    frame = LocalFrame(vehicle.home)
    lat, lon, alt = frame.geodetic_from_ned(
        north + radius_m * math.cos(right), east + radius_m * math.sin(right), -options.own_altitude_m
    )
    await vehicle.loiter(
        GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt), radius_m=radius_m, clockwise=True
    )

    def passing() -> bool:
        p = vehicle.latest(telemetry.Position)
        if p is None:
            return False
        n, e, _ = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        over_ground = math.atan2(p.vel_ned_m_s[1], p.vel_ned_m_s[0])
        near = math.hypot(n - north, e - east) < max(40.0, 0.4 * radius_m)
        return near and abs(math.remainder(over_ground - course, math.tau)) < math.radians(20.0)

    await vehicle.wait_until(
        passing, what="the start of the pattern", on=("GLOBAL_POSITION_INT",), timeout_s=240.0
    )


class _PathFollower:
    """The place along the path, found again at every call."""

    def __init__(self, vehicle: Vehicle, options: FlightOptions, path: FlyablePath) -> None:
        self._vehicle = vehicle
        self._options = options
        self._path = path
        self._frame = LocalFrame(vehicle.home)
        self._arc_m = 0.0

    def _update(self) -> tuple[float, float, float] | None:
        """(north, east) m and ground speed now; None at the path's end."""
        vehicle, path = self._vehicle, self._path
        p = vehicle.latest(telemetry.Position)
        if p is None or not vehicle.armed:
            raise MissionError(f"the vehicle tells no position in flight; {vehicle.heard()}")
        n, e, _ = self._frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        late_s = (vehicle.clock.time_us - p.time_us) * 1e-6
        n, e = n + late_s * p.vel_ned_m_s[0], e + late_s * p.vel_ned_m_s[1]
        self._arc_m = max(self._arc_m, path.nearest(n, e, from_arc_m=self._arc_m, ahead_m=80.0))
        vehicle.notes.progress = self._arc_m / path.length_m
        return None if self._arc_m >= path.length_m - 1.0 else (n, e, max(5.0, p.ground_speed_m_s))

    def setpoint(self) -> Setpoint | None:
        """For PX4: the path's nearest point, its direction as velocity, its bend as acceleration."""
        here = self._update()
        if here is None:
            return None
        (north, east), course, bend = self._path.at(self._arc_m)
        speed = here[2]
        push = speed * speed * bend
        return Setpoint(
            position_ned_m=(north, east, -self._options.own_altitude_m),
            velocity_ned_m_s=(speed * math.cos(course), speed * math.sin(course), 0.0),
            acceleration_ned_m_s2=(-push * math.sin(course), push * math.cos(course), 0.0),
        )

    def course(self) -> tuple[float, float] | None:
        """For ArduPilot: (course to fly, centripetal acceleration that its turn may take)."""
        here = self._update()
        if here is None:
            return None
        north, east, speed = here
        ahead_m = self._arc_m + speed * _LEAD_S
        (pn, pe), course, _ = self._path.at(self._arc_m)
        across = -(north - pn) * math.sin(course) + (east - pe) * math.cos(course)
        _, course_ahead, bend = self._path.at(ahead_m)
        back = math.atan(across / (speed * _CROSS_TRACK_S))
        wanted = course_ahead - max(-_STEEPEST_RAD, min(_STEEPEST_RAD, back))
        return wanted, max(3.0, 1.5 * speed * speed * abs(bend))


async def _follow_by_courses(vehicle: Vehicle, options: FlightOptions, follower: _PathFollower) -> None:
    """ArduPilot's plane takes no places as setpoints, but courses."""
    from missions.vehicle.adapter import Mode

    await vehicle.set_mode(Mode.GUIDED)
    await vehicle.change_altitude(options.own_altitude_m)
    await vehicle.change_airspeed(options.speed_m_s)
    clock = vehicle.clock
    while (wanted := follower.course()) is not None:
        await vehicle.command_int(
            dialect.MAV_CMD_GUIDED_CHANGE_HEADING,
            dialect.MAV_FRAME_GLOBAL,
            (_COURSE, math.degrees(wanted[0]) % 360.0, min(wanted[1], 1.2 * GRAVITY_M_S2), 0.0),
            0,
            0,
            0.0,
        )
        await clock.sleep(1.0 / _COURSE_HZ)
