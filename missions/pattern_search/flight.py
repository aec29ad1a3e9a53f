"""Flies a pattern: as an uploaded waypoint mission, or by streamed setpoints."""

import asyncio
import math
from collections.abc import Coroutine
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from autopilot_bridge.clock import VirtualTimeLoop
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.vectors import Vector
from missions.base.options import FlightOptions, Via
from missions.errors import PlanError, VehicleTimeout
from missions.pattern_search.tag_watch import TagWatch
from missions.pattern_search.wings.pattern import check_wings, fly_pattern_with_wings, pattern_flight_of
from missions.pattern_search.wings.waypoints import mission_items
from missions.patterns.curve import ArcLengthTable, Array, Curve
from missions.patterns.polyline import Polyline
from missions.planning.natural import is_lissajous, natural_frequencies, natural_trajectory
from missions.planning.outline import Outline
from missions.planning.trajectory import (
    Trajectory,
    TrajectoryPoint,
    flight_curve,
    line_trajectory,
    plan_trajectory,
)
from missions.planning.waypoints import leg_speeds, waypoints_along
from missions.vehicle.guided import GuidedSession
from missions.vehicle.limits import FixedWingLimits, Limits, MulticopterLimits
from missions.vehicle.notes import PATTERN, CommandedPath, CutShort
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.telemetry import Attitude
from missions.vehicle.vehicle import Vehicle

_SETTLE_S: Final = 1.5
_SAME_PLACE_M: Final = 0.3
_PATH_STEP_M: Final = 0.25
_OUTLINE_STEP_M: Final = 5.0
_TRANSIT_M_S: Final = 5.0
_SPEED_STEP_M_S: Final = 0.5


def check_pattern(curve: Curve, options: FlightOptions, limits: Limits) -> None:
    """Raise PlanError if a vehicle with these limits can't fly the pattern."""
    if isinstance(limits, FixedWingLimits):
        check_wings(curve, options, limits)
    else:
        limits.check_separation(options.separation_m, options.vehicles)
        plan_pattern(curve, options, limits)


def plan_pattern(curve: Curve, options: FlightOptions, limits: MulticopterLimits) -> Trajectory:
    """The trajectory of the pattern around its own centre.

    Raises:
        PlanError: the vehicle can't fly it.
    """
    altitude_m = options.own_altitude_m
    if options.period_s is not None:
        if not is_lissajous(curve):
            raise PlanError("`period_s` is for lissajous patterns; choose `speed_m_s` for this one")
        return natural_trajectory(
            curve,
            fundamental_period_s=_fundamental_period_s(curve, options.period_s),
            altitude_m=altitude_m,
            limits=limits,
            duration_s=options.search_time_s,
        )
    return plan_trajectory(
        flight_curve(curve, options.acceptance_m),
        altitude_m=altitude_m,
        speed_m_s=options.speed_m_s,
        limits=limits,
        duration_s=options.search_time_s,
    )


def _fundamental_period_s(curve: Curve, period_s: float) -> float:
    inner: Curve = getattr(curve, "curve", curve)
    return period_s * math.tau / (inner.end if inner.closed else math.tau)


def pattern_frequencies(curve: Curve, period_s: float) -> tuple[float, float]:
    """Frequencies east and north, rad/s, of a Lissajous pattern that is flown in its own time law."""
    return natural_frequencies(curve, _fundamental_period_s(curve, period_s))


async def fly_pattern(
    vehicle: Vehicle, options: FlightOptions, curve: Curve, search: TagWatch | None = None
) -> None:
    """Fly a curve as the options specify, including takeoff and landing.

    The vehicle is ready (`wait_ready`) and on the ground. The commanded path and the phases are stored in its
    notes.

    Args:
        search: ends the pattern when its tag is found, or its time is over; None: the pattern is flown to its
            end.

    Raises:
        PlanError: the vehicle's parameters don't allow the pattern.
        MissionError: the flight failed.
    """
    limits = await vehicle.limits(options.own_altitude_m)
    if isinstance(limits, FixedWingLimits):
        await fly_pattern_with_wings(vehicle, options, curve, limits)
        return
    # virtual time stands still, so that flights are reproducible
    if isinstance(asyncio.get_running_loop(), VirtualTimeLoop):
        trajectory = plan_pattern(curve, options, limits)
    else:  # heartbeats continue
        trajectory = await asyncio.to_thread(plan_pattern, curve, options, limits)
    centre = _centre(vehicle, options)
    if options.via is Via.SETPOINTS:
        await _fly_setpoints(vehicle, options, limits, trajectory, centre, search)
    else:
        await _fly_waypoints(vehicle, options, curve, trajectory, centre, search)


def pattern_outline(vehicle: Vehicle, options: FlightOptions, curve: Curve) -> Outline:
    """The path and the duration of a pattern, before it is planned in detail."""
    table = ArcLengthTable.of(curve, _OUTLINE_STEP_M)
    north_m, east_m, _ = _centre(vehicle, options)
    points = [(float(n) + north_m, float(e) + east_m, -options.own_altitude_m) for n, e in table.points_m]
    duration_s = float(table.arc_m[-1]) / options.speed_m_s
    return Outline(
        points_ned_m=tuple(points), duration_s=min(duration_s, options.search_time_s or duration_s)
    )


def _centre(vehicle: Vehicle, options: FlightOptions) -> Vector:
    """The pattern's centre, from home."""
    c = options.centre
    if c is None:
        return 0.0, 0.0, 0.0
    north, east, _ = LocalFrame(vehicle.home).ned_from_geodetic(c.lat_deg, c.lon_deg, c.alt_m)
    return north, east, 0.0


def setpoint_at(point: TrajectoryPoint, centre: Vector) -> Setpoint:
    """A trajectory's point as a setpoint with full feed-forward, its position moved to the centre."""
    n, e, d = point.position_ned_m
    return Setpoint(
        position_ned_m=(n + centre[0], e + centre[1], d + centre[2]),
        velocity_ned_m_s=point.velocity_ned_m_s,
        acceleration_ned_m_s2=point.acceleration_ned_m_s2,
        yaw_rad=point.yaw_rad,
        yaw_rate_rad_s=point.yaw_rate_rad_s,
    )


async def _fly_setpoints(
    vehicle: Vehicle,
    options: FlightOptions,
    limits: MulticopterLimits,
    trajectory: Trajectory,
    centre: Vector,
    search: TagWatch | None,
) -> None:
    notes, clock = vehicle.notes, vehicle.clock
    altitude_m = options.own_altitude_m
    notes.commanded = CommandedPath(
        origin=vehicle.home,
        points_ned_m=trajectory.position_ned_m[:: max(1, round(_PATH_STEP_M / (options.speed_m_s * 0.02)))]
        + np.array(centre),
        waypoints_ned_m=np.zeros((0, 3)),
        acceptance_m=options.acceptance_m,
    )
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.takeoff(altitude_m)
    notes.commanded = replace(notes.commanded, origin=vehicle.home)  # arming has set the home again
    above_home = (0.0, 0.0, -altitude_m)
    first = setpoint_at(trajectory.at(0.0), centre)
    last = setpoint_at(trajectory.at(trajectory.duration_s), centre)
    assert first.position_ned_m is not None and last.position_ned_m is not None
    async with vehicle.guided(options.rate_hz) as guided:
        notes.begin("transit", clock.stamp_us)
        await _fly_line(vehicle, guided, above_home, first.position_ned_m, limits)
        await _turn(vehicle, guided, first.position_ned_m, first.yaw_rad or 0.0, limits)
        notes.begin(PATTERN, clock.stamp_us)
        duration_s = trajectory.duration_s

        def source(t: float) -> Setpoint | None:
            nonlocal last
            notes.progress = min(1.0, t / duration_s)
            if t > duration_s:
                return None
            setpoint = setpoint_at(trajectory.at(t), centre)
            if search is not None and search.over:
                last, notes.cut_short = setpoint, search.ended_by
                assert notes.commanded is not None
                path = notes.commanded.points_ned_m
                notes.commanded = replace(
                    notes.commanded, points_ned_m=path[: max(2, math.floor(notes.progress * len(path)))]
                )
                return None
            return setpoint

        await guided.follow(source)
        vehicle.sensors.release()
        notes.begin("return", clock.stamp_us)
        assert last.position_ned_m is not None
        await _fly_line(vehicle, guided, last.position_ned_m, above_home, limits)
    await vehicle.land()
    notes.end(clock.stamp_us)


async def _fly_line(
    vehicle: Vehicle, guided: GuidedSession, start: Vector, stop: Vector, limits: MulticopterLimits
) -> None:
    """Turn to the direction of the leg, and fly straight from rest to rest."""
    if math.dist(start, stop) < _SAME_PLACE_M:
        return
    line = line_trajectory(start, stop, speed_m_s=_TRANSIT_M_S, limits=limits)
    await _turn(vehicle, guided, start, line.at(0.0).yaw_rad, limits)
    await guided.follow(lambda t: setpoint_at(line.at(t), (0.0, 0.0, 0.0)) if t <= line.duration_s else None)


async def _turn(
    vehicle: Vehicle, guided: GuidedSession, position: Vector, yaw_rad: float, limits: MulticopterLimits
) -> None:
    """Stay in a place, turn with at most the yaw rate, and settle for a short time."""
    attitude = vehicle.latest(Attitude)
    start_rad = yaw_rad if attitude is None else attitude.yaw_rad
    turn_rad = math.remainder(yaw_rad - start_rad, math.tau)
    turn_s = max(0.1, 1.5 * abs(turn_rad) / limits.yaw_rate_rad_s)

    def source(t: float) -> Setpoint | None:
        if t > turn_s + _SETTLE_S:
            return None
        f = min(1.0, t / turn_s)
        return Setpoint(
            position_ned_m=position,
            velocity_ned_m_s=(0.0, 0.0, 0.0),
            yaw_rad=math.remainder(start_rad + turn_rad * f * f * (3.0 - 2.0 * f), math.tau),
            yaw_rate_rad_s=turn_rad * 6.0 * f * (1.0 - f) / turn_s,
        )

    await guided.follow(source)


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointPlan:
    """A plan to upload, and the items of the pattern in it.

    Attributes:
        items: the plan.
        first, last: indices of the pattern's first and last waypoint.
    """

    items: list[MissionItem]
    first: int
    last: int


def waypoint_plan(
    vehicle: Vehicle,
    points: list[tuple[float, float]],
    speeds_m_s: list[float],
    options: FlightOptions,
    centre: Vector,
) -> WaypointPlan:
    """The plan to upload: takeoff, waypoints with their speeds, and return."""
    home = vehicle.home
    frame = LocalFrame(home)
    unset = vehicle.firmware.unset
    altitude_m = options.own_altitude_m
    waypoint, land = dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_NAV_LAND

    def over(command: int, north_m: float, east_m: float, height_m: float) -> MissionItem:
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        return MissionItem(
            command=command, param2=options.acceptance_m, param4=unset, x=lat, y=lon, z=height_m
        )

    items = [vehicle.firmware.takeoff_item(home, altitude_m)]
    current_m_s = 0.0
    first = None
    for (north_m, east_m), speed_m_s in zip(points, speeds_m_s, strict=True):
        rounded = max(_SPEED_STEP_M_S, _SPEED_STEP_M_S * math.floor(speed_m_s / _SPEED_STEP_M_S + 1e-6))
        if rounded != current_m_s:
            items.append(_speed_item(rounded))
            current_m_s = rounded
        first = len(items) if first is None else first
        items.append(over(waypoint, north_m + centre[0], east_m + centre[1], altitude_m))
    last = len(items) - 1
    if options.vehicles > 1:  # return in its own layer: RTL takes all vehicles to the same altitude
        items.append(_speed_item(options.speed_m_s))
        items += [over(waypoint, 0.0, 0.0, altitude_m), replace(over(land, 0.0, 0.0, 0.0), param2=0.0)]
    else:
        items.append(
            MissionItem(command=dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=dialect.MAV_FRAME_MISSION)
        )
    return WaypointPlan(items=items, first=first or 0, last=last)


def _speed_item(speed_m_s: float) -> MissionItem:
    return MissionItem(
        command=dialect.MAV_CMD_DO_CHANGE_SPEED,
        frame=dialect.MAV_FRAME_MISSION,
        param1=1.0,
        param2=speed_m_s,
        param3=-1.0,
    )


def _length_m(options: FlightOptions) -> float | None:
    """Length of a pattern that ends with its search time."""
    return None if options.search_time_s is None else options.search_time_s * options.speed_m_s


def _points_and_plan(
    vehicle: Vehicle, options: FlightOptions, curve: Curve, trajectory: Trajectory, centre: Vector
) -> tuple[list[tuple[float, float]], WaypointPlan]:
    """The pattern's waypoints around its centre, and the plan to upload."""
    points = waypoints_along(curve, length_m=_length_m(options))
    # the vehicle rounds a polyline's corners by itself: its long legs are flown at full speed
    speeds = [options.speed_m_s] * len(points)
    if not isinstance(curve, Polyline):
        speeds = leg_speeds(points, trajectory)
    return points, waypoint_plan(vehicle, points, speeds, options, centre)


async def pattern_items(vehicle: Vehicle, options: FlightOptions, curve: Curve) -> list[MissionItem]:
    """The mission items that would be uploaded for a pattern, including takeoff and landing.

    Raises:
        PlanError: the vehicle's parameters don't allow the pattern.
    """
    limits = await vehicle.limits(options.own_altitude_m)
    if isinstance(limits, FixedWingLimits):
        return mission_items(vehicle, pattern_flight_of(vehicle, options, curve, limits)).items
    trajectory = plan_pattern(curve, options, limits)
    return _points_and_plan(vehicle, options, curve, trajectory, _centre(vehicle, options))[1].items


async def _fly_waypoints(
    vehicle: Vehicle,
    options: FlightOptions,
    curve: Curve,
    trajectory: Trajectory,
    centre: Vector,
    search: TagWatch | None,
) -> None:
    notes, clock = vehicle.notes, vehicle.clock
    length_m = _length_m(options)
    acceptance_m = await vehicle.adapter.acceptance_m(options.acceptance_m)
    points, plan = _points_and_plan(vehicle, options, curve, trajectory, centre)
    down_m = -options.own_altitude_m
    offset = np.array(centre)
    notes.commanded = CommandedPath(
        origin=vehicle.home,
        points_ned_m=_flat_path(curve, length_m, down_m) + offset,
        waypoints_ned_m=np.array([(n, e, down_m) for n, e in points]) + offset,
        acceptance_m=acceptance_m,
    )
    notes.begin("upload", clock.stamp_us)
    start = await vehicle.plans.upload_mission(plan.items)
    first, last = start + plan.first, start + plan.last
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.start_mission()
    route_m = float(np.linalg.norm(np.diff(notes.commanded.points_ned_m, axis=0), axis=1).sum())
    reach_m = float(np.linalg.norm(notes.commanded.points_ned_m, axis=1).max())

    async def fly_items(waiting: Coroutine[Any, Any, None]) -> bool:
        if search is None:
            await waiting
            return False
        return await search.unless_over(waiting)

    over = await fly_items(
        vehicle.plans.wait_item_reached(first, 60.0 + 3.0 * options.own_altitude_m + reach_m)
    )
    if not over:  # a tag that is found on the way to the pattern ends the flight before it
        notes.begin(PATTERN, clock.stamp_us)

    reached = 0

    def progress(done: int) -> None:
        nonlocal reached
        reached = done - start
        notes.progress = min(1.0, max(0.0, (done - first) / max(1, last - first)))

    limit_s = 60.0 + 4.0 * route_m / options.speed_m_s
    if options.search_time_s is not None:
        limit_s = min(limit_s, options.search_time_s)
    try:
        over = over or await fly_items(vehicle.plans.wait_item_reached(last, limit_s, progress))
    except VehicleTimeout:
        if options.search_time_s is None:
            raise
        over = True  # the search time has ended
    vehicle.sensors.release()
    if over:
        notes.cut_short = CutShort.TIME if search is None else search.ended_by
        flown = [item.command for item in plan.items[: reached + 1]].count(dialect.MAV_CMD_NAV_WAYPOINT)
        notes.commanded = replace(
            notes.commanded, waypoints_ned_m=notes.commanded.waypoints_ned_m[:flown]
        )  # the way home may pass others
        await vehicle.return_to_launch(wait=False)
    notes.begin("return", clock.stamp_us)
    await vehicle.return_end.wait(300.0 + 2.0 * reach_m)
    notes.end(clock.stamp_us)


def _flat_path(curve: Curve, length_m: float | None, down_m: float) -> Array:
    table = ArcLengthTable.of(curve, _PATH_STEP_M)
    kept = slice(None) if length_m is None else slice(int(np.searchsorted(table.arc_m, length_m)) + 1)
    points = table.points_m[kept]
    return np.column_stack((points, np.full(len(points), down_m)))
